#include "optics/stack.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// Radau nodes on [low, 1]; found once, as finding them takes longer than a slab.
Quadrature Radau(int nodes, double low) {
  static std::mutex mutex;
  static std::map<std::pair<int, double>, Quadrature> known;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto [at, is_new] = known.try_emplace({nodes, low});
  if (is_new) at->second = GaussRadau(nodes, low, 1.0);
  return at->second;
}

/// Cosine in the denser medium of light that grazes in the rarer; exact however little they differ.
double CriticalCosine(double rare, double dense) { return std::sqrt((dense - rare) / dense * (1.0 + rare / dense)); }

Matrix Identity(Eigen::Index n) { return Matrix::Identity(n, n); }

}  // namespace

AllDirections::AllDirections(const std::vector<double>& indices, int nodes, const std::vector<double>& views)
    : normal_(nodes - 1) {
  std::vector<double> ascending = indices;
  std::sort(ascending.begin(), ascending.end());
  for (const double n : ascending)
    if (indices_.empty() || n > (1.0 + kSameIndex) * indices_.back()) indices_.push_back(n);
  for (size_t k = 0; k < indices_.size(); ++k) {
    const double end = k == 0 ? 1.0 : CriticalCosine(indices_[k - 1], indices_[k]);
    const double next = k + 1 < indices_.size() ? CriticalCosine(indices_[k], indices_[k + 1]) : HUGE_VAL;
    // Short of the group's fourth node nothing would resolve where the denser medium's cosines bend.
    const bool is_narrow = next < std::pow(6.0 / nodes, 2) * end;
    const double begin = is_narrow ? 0.2 * end : 0.0;
    Quadrature q = k == 0 ? Radau(nodes, begin) : GaussLegendre(nodes, begin, end);
    if (k == 0) {
      constexpr double kNextToNothing = 1e-12;
      q.node.insert(q.node.end(), views.begin(), views.end());
      q.weight.insert(q.weight.end(), views.size(), kNextToNothing);
    }
    if (is_narrow) {
      // Cosines next sinh(t) here and next cosh(t) there: t has nothing to resolve.
      const Quadrature t = GaussLegendre(nodes, 0.0, std::asinh(begin / next));
      for (size_t i = 0; i < t.node.size(); ++i) {
        q.node.push_back(next * std::sinh(t.node[i]));
        q.weight.push_back(next * std::cosh(t.node[i]) * t.weight[i]);
      }
    }
    groups_.push_back(std::move(q));
  }
}

Directions AllDirections::In(double ior) const {
  const auto end = std::upper_bound(indices_.begin(), indices_.end(), ior);
  const double same = *std::prev(end);
  std::vector<double> cosine, weight;
  for (size_t k = 0; k < static_cast<size_t>(end - indices_.begin()); ++k) {
    const double ratio = indices_[k] / same, critical = CriticalCosine(indices_[k], same);
    for (size_t i = 0; i < groups_[k].node.size(); ++i) {
      const double mu = groups_[k].node[i];
      cosine.push_back(std::hypot(critical, ratio * mu));
      weight.push_back(groups_[k].weight[i] * ratio * ratio * mu / cosine.back());
    }
  }
  const auto n = static_cast<Eigen::Index>(cosine.size());
  return {Eigen::Map<Vector>(cosine.data(), n), Eigen::Map<Vector>(weight.data(), n), same};
}

/// Total reflection for directions that only the denser side has; a rounding short of 1: light trapped in a clear
/// layer, which nothing ever enters, would be 0 / 0. The others' Fresnel reflectance is taken on the rarer side, where
/// nothing cancels.
Interface::Interface(const Directions& above, const Directions& below)
    : reflect_down(above.size()), reflect_up(below.size()), transmit(std::min(above.size(), below.size())) {
  constexpr double kTotal = 1.0 - 0x1.0p-50;
  reflect_down.setConstant(kTotal);
  reflect_up.setConstant(kTotal);
  const bool is_denser_below = above.ior < below.ior;
  const Directions &rare = is_denser_below ? above : below, &dense = is_denser_below ? below : above;
  for (Eigen::Index i = 0; i < transmit.size(); ++i) {
    const double f = Terms<double>::FresnelReflectance(rare.cosine[i], dense.ior / rare.ior);
    reflect_down[i] = reflect_up[i] = f;
    transmit[i] = 1.0 - f;
  }
}

LayerModes::LayerModes(const SlabLayer& layer, const Directions& d, int moments) {
  const Eigen::Index n = d.size();
  const double extinction = layer.scattering_per_mm + layer.absorption_per_mm;
  const double albedo0 = extinction > 0 ? layer.scattering_per_mm / extinction : 0.0;
  const auto moment = [&](int l) { return l == 0 ? 1.0 : (1.0 - layer.isotropic_fraction) * std::pow(layer.g, l); };
  const double peak = moment(moments);
  const double albedo = albedo0 * (1.0 - peak) / (1.0 - albedo0 * peak);
  extinction_per_mm_ = (1.0 - albedo0 * peak) * extinction;
  root_of_flux_ = d.cosine.cwiseProduct(d.weight).cwiseSqrt();
  if (extinction_per_mm_ <= 0) return;

  // Phase function of moments that change sign with the cosine, and of the others: for like and unlike cosines it is
  // even + odd and even - odd.
  Matrix even = Matrix::Zero(n, n), odd = Matrix::Zero(n, n);
  Vector before = Vector::Zero(n), now = Vector::Ones(n);
  for (int l = 0; l < moments; ++l) {
    const double c = (2 * l + 1) * (moment(l) - peak) / (1.0 - peak);
    (l % 2 == 0 ? even : odd).noalias() += c * now * now.transpose();
    const Vector next = ((2 * l + 1) * d.cosine.cwiseProduct(now) - l * before) / (l + 1);
    before = now;
    now = next;
  }
  // The quadrature's error in the phase function's integral goes to the diagonal, so that nothing is gained or lost.
  const Vector shortfall = Vector::Ones(n) - even * d.weight;
  // With u, v the sum and difference of the radiances down and up, and D = sqrt(cosine weight):
  // d (D u) / d depth = -E (D v), d (D v) / d depth = -F (D u), both symmetric.
  const Vector root = d.weight.cwiseSqrt(), inverse_root = d.cosine.cwiseSqrt().cwiseInverse();
  const auto symmetric = [&](const Matrix& phase) {
    Matrix m = -albedo * (root.asDiagonal() * phase * root.asDiagonal());
    m.diagonal() += (1.0 - albedo * shortfall.array()).matrix();
    return Matrix(inverse_root.asDiagonal() * m * inverse_root.asDiagonal());
  };
  const Eigen::LLT<Matrix> factors(symmetric(odd));  // E = L L'
  const Matrix lower = factors.matrixL();
  // L'FL has the modes and their squared decays s. Solvers are exact to a share of the largest eigenvalue, and the s of
  // grazing directions are too large for that; 1 / (1 + s) is small for those and at most 1.
  Matrix one_plus = lower.transpose() * symmetric(even) * lower;
  one_plus.diagonal().array() += 1.0;
  const Eigen::SelfAdjointEigenSolver<Matrix> eigen(Matrix(one_plus.llt().solve(Identity(n))));
  decay_ = (eigen.eigenvalues().cwiseInverse().array() - 1.0).cwiseMax(0.0).sqrt();
  // The smallest is what a thick layer transmits by, and much less than 1. By its Rayleigh quotient in a form in which
  // nothing cancels: what is absorbed, and differences between directions.
  const double absorbed = layer.absorption_per_mm / extinction_per_mm_;  // 1 - albedo
  const Vector y = (lower * eigen.eigenvectors().col(n - 1)).cwiseQuotient(root_of_flux_);
  double square = absorbed * y.cwiseAbs2().dot(d.weight);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < i; ++j)
      square += albedo * even(i, j) * d.weight[i] * d.weight[j] * (y[i] - y[j]) * (y[i] - y[j]);
  decay_[n - 1] = std::sqrt(std::max(0.0, square));
  absorbs_ = layer.absorption_per_mm > 0;
  modes_ = factors.matrixU().solve(eigen.eigenvectors());
}

Stack LayerModes::OfThickness(double thickness_mm) const {
  const Eigen::Index n = root_of_flux_.size();
  const double half = 0.5 * extinction_per_mm_ * thickness_mm;
  if (half <= 0) return {Matrix::Zero(n, n), Identity(n), Matrix::Zero(n, n), Identity(n)};
  // Lit alike from both sides, v / u at the top is modes decay tanh(decay half) modes'; lit with opposite signs, coth.
  // Reflected plus, and minus, transmitted is then 2 / (1 + v / u) - 1.
  Vector like(n), unlike(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = std::tanh(decay_[i] * half);
    like[i] = decay_[i] * t;
    unlike[i] = t > 1e-9 ? decay_[i] / t : 1.0 / half;
  }
  const auto inverse = [&](const Vector& of_mode) {
    Matrix m = modes_ * of_mode.asDiagonal() * modes_.transpose();
    m.diagonal().array() += 1.0;
    return Matrix(m.llt().solve(Identity(n)));
  };
  const Matrix a = inverse(like), b = inverse(unlike);
  const Vector back = root_of_flux_.cwiseInverse();
  Matrix reflect = back.asDiagonal() * (a + b - Identity(n)) * root_of_flux_.asDiagonal(),
         transmit = back.asDiagonal() * (a - b) * root_of_flux_.asDiagonal();
  if (!absorbs_) {  // what comes in leaves, but for roundings
    const Vector flux = root_of_flux_.cwiseAbs2();
    const Vector kept = flux.cwiseQuotient((reflect + transmit).transpose() * flux);
    reflect *= kept.asDiagonal();
    transmit *= kept.asDiagonal();
  }
  return {reflect, transmit, reflect, transmit};
}

// Between two parts light goes back and forth: (1 - R R)^-1.

Stack Add(const Stack& a, const Interface& b) {
  const Eigen::Index n = a.reflect_up.rows(), below = b.reflect_up.size(), both = b.transmit.size();
  const Eigen::PartialPivLU<Matrix> between(Identity(n) - a.reflect_up * b.reflect_down.asDiagonal());
  const Matrix down = between.solve(a.transmit_down);
  const Matrix turned = between.solve(Matrix(a.reflect_up.leftCols(both) * b.transmit.asDiagonal()));
  Stack s{a.reflect_down + a.transmit_up * (b.reflect_down.asDiagonal() * down), Matrix::Zero(below, down.cols()),
          Matrix(b.reflect_up.asDiagonal()), Matrix::Zero(a.transmit_up.rows(), below)};
  s.transmit_down.topRows(both) = b.transmit.asDiagonal() * down.topRows(both);
  s.reflect_up.topLeftCorner(both, both) += b.transmit.asDiagonal() * turned.topRows(both);
  s.transmit_up.leftCols(both) = a.transmit_up.leftCols(both) * b.transmit.asDiagonal();
  s.transmit_up.leftCols(both).noalias() += a.transmit_up * (b.reflect_down.asDiagonal() * turned);
  return s;
}

Stack Add(const Interface& a, const Stack& b) {
  // The same seen from below.
  const Interface turned = [&] {
    Interface i = a;
    std::swap(i.reflect_down, i.reflect_up);
    return i;
  }();
  Stack s = Add(Stack{b.reflect_up, b.transmit_up, b.reflect_down, b.transmit_down}, turned);
  std::swap(s.reflect_down, s.reflect_up);
  std::swap(s.transmit_down, s.transmit_up);
  return s;
}

Stack Add(const Stack& a, const Stack& b) {
  const Matrix one = Identity(b.reflect_down.rows());
  const Eigen::PartialPivLU<Matrix> downward(one - a.reflect_up * b.reflect_down),
      upward(one - b.reflect_down * a.reflect_up);
  const Matrix down = downward.solve(a.transmit_down), up = upward.solve(b.transmit_up);
  return {a.reflect_down + a.transmit_up * b.reflect_down * down, b.transmit_down * down,
          b.reflect_up + b.transmit_down * a.reflect_up * up, a.transmit_up * up};
}

Stack Backing(const Directions& d, double reflectance) {
  const Eigen::Index n = d.size();
  const Vector flux = d.FluxWeights() / (d.ior * d.ior);
  const Matrix spread = Vector::Ones(n) * flux.transpose() / flux.sum();
  return {reflectance * spread, (1.0 - reflectance) * Identity(n), Matrix::Zero(n, n), Matrix::Zero(n, n)};
}

}  // namespace crownfit
