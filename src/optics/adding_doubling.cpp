#include "optics/adding_doubling.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "optics/quadrature.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// Directions of one medium: cosines and quadrature weights. A direction that a boundary refracts has the same number
/// on both sides; the densest medium has all of them, the others the first `size`.
struct Directions {
  Vector cosine, weight;
  double ior;
  Eigen::Index size() const { return cosine.size(); }
  /// Share of a hemisphere's flux of basic radiance (L / n^2) that each direction carries.
  Vector FluxWeights() const { return 2.0 * ior * ior * cosine.cwiseProduct(weight); }
};

/// Groups of directions by index, the rarest medium first: Radau cosines there (with normal incidence), and for every
/// denser one the Gauss cosines that are totally reflected towards the next rarer.
class AllDirections {
 public:
  AllDirections(std::vector<double> indices, int nodes) : indices_(std::move(indices)) {
    std::sort(indices_.begin(), indices_.end());
    indices_.erase(std::unique(indices_.begin(), indices_.end()), indices_.end());
    for (size_t k = 0; k < indices_.size(); ++k) {
      const double critical = k == 0 ? 1.0 : std::sqrt(1.0 - std::pow(indices_[k - 1] / indices_[k], 2));
      groups_.push_back(k == 0 ? GaussRadau(nodes, 0.0, 1.0) : GaussLegendre(nodes, 0.0, critical));
    }
  }
  Directions In(double ior) const {
    std::vector<double> cosine, weight;
    for (size_t k = 0; k < indices_.size() && indices_[k] <= ior; ++k) {
      const double ratio = indices_[k] / ior;
      for (size_t i = 0; i < groups_[k].node.size(); ++i) {
        const double mu = groups_[k].node[i];
        cosine.push_back(std::sqrt(1.0 - ratio * ratio * (1.0 - mu) * (1.0 + mu)));
        weight.push_back(groups_[k].weight[i] * ratio * ratio * mu / cosine.back());
      }
    }
    const auto n = static_cast<Eigen::Index>(cosine.size());
    return {Eigen::Map<Vector>(cosine.data(), n), Eigen::Map<Vector>(weight.data(), n), ior};
  }
  Eigen::Index NormalIncidence() const { return static_cast<Eigen::Index>(groups_[0].node.size()) - 1; }

 private:
  std::vector<double> indices_;
  std::vector<Quadrature> groups_;
};

/// What a stack of layers does to basic radiance: light from above (`down`) and from below (`up`).
struct Stack {
  Matrix reflect_down, transmit_down, reflect_up, transmit_up;
};

Stack Add(const Stack& a, const Stack& b) {
  // Between a and b light goes back and forth: (1 - R R)^-1.
  const Eigen::Index n = b.reflect_down.rows();
  const Matrix identity = Matrix::Identity(n, n);
  const Eigen::PartialPivLU<Matrix> downward(identity - a.reflect_up * b.reflect_down),
      upward(identity - b.reflect_down * a.reflect_up);
  const Matrix down = downward.solve(a.transmit_down), up = upward.solve(b.transmit_up);
  return {a.reflect_down + a.transmit_up * b.reflect_down * down, b.transmit_down * down,
          b.reflect_up + b.transmit_down * a.reflect_up * up, a.transmit_up * up};
}

/// Fresnel boundary between media; diagonal, total reflection for directions that only the denser side has. Total is a
/// rounding short of 1: light trapped in a clear layer, which nothing ever enters, would be 0 / 0.
Stack Interface(const Directions& above, const Directions& below) {
  Stack s{Matrix::Zero(above.size(), above.size()), Matrix::Zero(below.size(), above.size()),
          Matrix::Zero(below.size(), below.size()), Matrix::Zero(above.size(), below.size())};
  constexpr double kTotal = 1.0 - 0x1.0p-50;
  for (Eigen::Index i = 0; i < std::max(above.size(), below.size()); ++i) {
    if (i < above.size() && i < below.size()) {
      const double f = Terms<double>::FresnelReflectance(above.cosine[i], below.ior / above.ior);
      s.reflect_down(i, i) = s.reflect_up(i, i) = f;
      s.transmit_down(i, i) = s.transmit_up(i, i) = 1.0 - f;
    } else if (i < above.size()) {
      s.reflect_down(i, i) = kTotal;
    } else {
      s.reflect_up(i, i) = kTotal;
    }
  }
  return s;
}

/// One homogeneous layer between boundaries of its own index: doubled from a thin start by the diamond rule (Grant and
/// Hunt 1969). Phase function by Legendre moments, its forward peak cut off by delta-M (Wiscombe 1977).
Stack HomogeneousLayer(const SlabLayer& layer, const Directions& d, int moments) {
  const Eigen::Index n = d.size();
  const double extinction = layer.scattering_per_mm + layer.absorption_per_mm;
  const double albedo0 = extinction > 0 ? layer.scattering_per_mm / extinction : 0.0;
  const auto moment = [&](int l) { return l == 0 ? 1.0 : (1.0 - layer.isotropic_fraction) * std::pow(layer.g, l); };
  const double peak = moment(moments);
  const double depth = (1.0 - albedo0 * peak) * extinction * layer.thickness_mm;
  const double albedo = albedo0 * (1.0 - peak) / (1.0 - albedo0 * peak),
               loss = extinction > 0 ? layer.absorption_per_mm / (extinction * (1.0 - albedo0 * peak))
                                     : 0.0;  // 1 - albedo
  Stack s{Matrix::Zero(n, n), Matrix::Identity(n, n), Matrix::Zero(n, n), Matrix::Identity(n, n)};
  if (depth <= 0) return s;

  Matrix forward = Matrix::Zero(n, n),
         backward = Matrix::Zero(n, n);  // phase function between cosines of like, unlike sign
  Vector before = Vector::Zero(n), now = Vector::Ones(n);
  for (int l = 0; l < moments; ++l) {
    const double c = (2 * l + 1) * (moment(l) - peak) / (1.0 - peak);
    const Matrix term = c * now * now.transpose();
    forward += term;
    backward += l % 2 == 0 ? term : -term;
    const Vector next = ((2 * l + 1) * d.cosine.cwiseProduct(now) - l * before) / (l + 1);
    before = now;
    now = next;
  }
  // The quadrature's error in the phase function's integral goes to the diagonal, so that nothing is gained or lost.
  const Vector integral = 0.5 * (forward + backward) * d.weight;
  for (Eigen::Index i = 0; i < n; ++i) forward(i, i) += 2.0 * (1.0 - integral[i]) / d.weight[i];

  // Thin enough that the diamond rule's error, of second order, stays below 1e-8 at the shallowest direction.
  const int doublings = std::max(0, static_cast<int>(std::ceil(std::log2(depth / (d.cosine.minCoeff() * 0x1.0p-14)))));
  const double thin = std::ldexp(depth, -doublings);
  const Matrix scale = (0.5 * thin * d.cosine.cwiseInverse()).asDiagonal(), weights = d.weight.asDiagonal();
  const Matrix identity = Matrix::Identity(n, n);
  const Matrix a = scale * (identity - 0.5 * albedo * forward * weights),
               b = scale * (0.5 * albedo * backward * weights);
  const Matrix inverse = (identity + a).inverse();
  const Matrix g = (identity + a - b * inverse * b).inverse();
  Matrix reflect = 2.0 * g * b * inverse, transmit = 2.0 * g - identity;
  // What the layer absorbs is followed by itself, by sums that can't cancel, and what leaves is kept equal to the rest:
  // a rounding lost in the thin start would be 1e-10 of absorption per scattering, which darkens thick white layers.
  const Vector flux = d.cosine.cwiseProduct(d.weight);
  Vector absorbed = 0.5 * thin * loss * (d.weight + (reflect + transmit).transpose() * d.weight);
  const auto keep_energy = [&] {
    const Vector leaves = (reflect + transmit).transpose() * flux;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (absorbed[i] > 0.5 * flux[i]) continue;  // there the small rest is the more exact
      const double factor = (flux[i] - absorbed[i]) / leaves[i];
      reflect.col(i) *= factor;
      transmit.col(i) *= factor;
    }
  };
  keep_energy();
  for (int k = 0; k < doublings; ++k) {
    const Eigen::PartialPivLU<Matrix> between(identity - reflect * reflect);
    const Matrix inside = between.solve(transmit);
    absorbed += inside.transpose() * (absorbed + reflect.transpose() * absorbed);
    reflect += transmit * reflect * inside;
    transmit = transmit * inside;
    keep_energy();
    if (transmit.cwiseAbs().maxCoeff() < 1e-14) break;
  }
  return {reflect, transmit, reflect, transmit};
}

/// Lambertian surface below; what it does not return counts as transmitted.
Stack Backing(const Directions& d, double reflectance) {
  const Eigen::Index n = d.size();
  const Vector flux = d.FluxWeights() / (d.ior * d.ior);
  const Matrix spread = Vector::Ones(n) * flux.transpose() / flux.sum();
  return {reflectance * spread, (1.0 - reflectance) * Matrix::Identity(n, n), Matrix::Zero(n, n), Matrix::Zero(n, n)};
}

}  // namespace

SlabAnswer SolveByAddingDoubling(const Slab& slab, const AddingDoublingOptions& options) {
  std::vector<double> indices{slab.ior_above};
  for (const auto& layer : slab.layers) indices.push_back(layer.ior);
  // A backing in contact has no medium before it.
  const double below_ior = slab.backing_contact ? slab.layers.back().ior : slab.ior_below;
  indices.push_back(below_ior);
  const AllDirections all(indices, options.nodes);
  const Directions above = all.In(slab.ior_above), below = all.In(below_ior);

  const int moments = 2 * options.nodes - 1;
  Stack stack = Interface(above, all.In(slab.layers[0].ior));
  for (size_t i = 0; i < slab.layers.size(); ++i) {
    const Directions here = all.In(slab.layers[i].ior);
    stack = Add(stack, HomogeneousLayer(slab.layers[i], here, moments));
    stack = Add(stack, Interface(here, i + 1 < slab.layers.size() ? all.In(slab.layers[i + 1].ior) : below));
  }
  if (slab.backing_reflectance > 0) stack = Add(stack, Backing(below, slab.backing_reflectance));

  SlabAnswer answer;
  answer.model = "layered";
  SetSpecular(slab, answer);
  const Vector in = above.FluxWeights(), out = below.FluxWeights();
  const Vector reflected = (in.transpose() * stack.reflect_down).transpose().cwiseQuotient(in),
               transmitted = (out.transpose() * stack.transmit_down).transpose().cwiseQuotient(in);
  const Eigen::Index normal = all.NormalIncidence();
  answer.value.reflectance_collimated = reflected[normal] - answer.specular;
  answer.value.transmittance_collimated = transmitted[normal];
  double mirrored = 0;  // by the first surface, over the same directions
  for (Eigen::Index i = 0; i < above.size(); ++i)
    mirrored +=
        in[i] / in.sum() * Terms<double>::FresnelReflectance(above.cosine[i], slab.layers[0].ior / slab.ior_above);
  answer.value.reflectance_diffuse = reflected.dot(in) / in.sum() - mirrored;
  answer.value.transmittance_diffuse = transmitted.dot(in) / in.sum();
  return answer;
}

}  // namespace crownfit
