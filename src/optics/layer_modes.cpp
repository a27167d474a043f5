#include "optics/layer_modes.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "base/error.h"
#include "base/linear_algebra.h"

namespace crownfit {
namespace {

using Eigen::Index;
using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// v / u of a mode of decay k in a layer of half depth h.
struct OfMode {
  double value, by_square, by_half;  ///< derivatives with respect to k^2 and h
};

constexpr double kShallow = 3e-3;  // below it series end at (k h)^4, above it differences keep ten digits

/// v / u at the top of a layer that is lit equally from both sides: k tanh(k h).
OfMode LitAlike(double k, double h) {
  const double x = k * h, t = std::tanh(x), sech = 1.0 / std::cosh(x);
  return {k * t, x < kShallow ? h * (1.0 - 2.0 / 3.0 * x * x) : (t + x * sech * sech) / (2.0 * k), k * k * sech * sech};
}

/// Lit with opposite signs: k coth(k h).
OfMode LitUnlike(double k, double h) {
  const double x = k * h, t = std::tanh(x), csch = 1.0 / std::sinh(x);
  if (x < kShallow)
    return {t > 1e-9 ? k / t : 1.0 / h, h / 3.0 * (1.0 - 2.0 / 15.0 * x * x), (x * x / 3.0 - 1.0) / (h * h)};
  return {k / t, (1.0 / t - x * csch * csch) / (2.0 * k), -k * k * csch * csch};
}

template <class Function>
std::vector<OfMode> ForEvery(const Vector& decay, double half, Function f) {
  std::vector<OfMode> modes;
  for (const double k : decay) modes.push_back(f(k, half));
  return modes;
}

/// Reflected plus (lit alike) or minus (lit unlike) transmitted light is 2 / (1 + v / u) - 1.
Eigen::LLT<Matrix> OnePlusRatio(const Matrix& modes, const std::vector<OfMode>& of_mode) {
  Vector value(modes.cols());
  for (Index i = 0; i < value.size(); ++i) value[i] = of_mode[i].value;
  Matrix m = modes * value.asDiagonal() * modes.transpose();
  m.diagonal().array() += 1.0;
  return Eigen::LLT<Matrix>(m);
}

}  // namespace

LayerModes::Cut LayerModes::CutPeak(const SlabLayer& layer, int moments) {
  const double extinction = layer.scattering_per_mm + layer.absorption_per_mm;
  const double albedo = extinction > 0 ? layer.scattering_per_mm / extinction : 0.0;
  const double peak = (1.0 - layer.isotropic_fraction) * std::pow(layer.g, moments);
  Cut cut;
  cut.extinction_per_mm = (1.0 - albedo * peak) * extinction;
  cut.albedo = albedo * (1.0 - peak) / (1.0 - albedo * peak);
  cut.absorbed = cut.extinction_per_mm > 0 ? layer.absorption_per_mm / cut.extinction_per_mm : 0.0;
  cut.moments = Vector(moments);
  double power = 1.0 - layer.isotropic_fraction;
  for (int l = 0; l < moments; ++l, power *= layer.g)
    cut.moments[l] = (2 * l + 1) * (l == 0 ? 1.0 : (power - peak) / (1.0 - peak));
  return cut;
}

LayerModes::Cut LayerModes::CutPeakChange(const SlabLayer& layer, const SlabLayer& change, int moments) {
  const double s = layer.scattering_per_mm, a = layer.absorption_per_mm, extinction = s + a;
  const double albedo = s / extinction,
               d_albedo = (a * change.scattering_per_mm - s * change.absorption_per_mm) / (extinction * extinction);
  Vector moment(moments + 1), d_moment(moments + 1);
  moment[0] = 1.0, d_moment[0] = 0.0;
  const double shaped = 1.0 - layer.isotropic_fraction;
  for (int l = 1; l <= moments; ++l) {
    const double below = std::pow(layer.g, l - 1);
    moment[l] = shaped * below * layer.g;
    d_moment[l] = shaped * l * below * change.g - change.isotropic_fraction * below * layer.g;
  }
  const double peak = moment[moments], d_peak = d_moment[moments];
  const double left = 1.0 - albedo * peak, d_left = -d_albedo * peak - albedo * d_peak;
  Cut cut;
  cut.extinction_per_mm = d_left * extinction + left * (change.scattering_per_mm + change.absorption_per_mm);
  cut.albedo = (d_albedo * (1.0 - peak) - albedo * d_peak - albedo * (1.0 - peak) / left * d_left) / left;
  if (change.g == 0 && change.isotropic_fraction == 0) return cut;
  cut.moments = Vector::Zero(moments);
  for (int l = 1; l < moments; ++l)
    cut.moments[l] = (2 * l + 1) * (d_moment[l] - (1.0 - moment[l]) / (1.0 - peak) * d_peak) / (1.0 - peak);
  return cut;
}

/// Phase function from its odd and even moments: even + odd for cosines of like sign, even - odd for unlike ones. The
/// quadrature error of its integral goes to the diagonal, so that energy is conserved.
LayerModes::Turned LayerModes::TurnedBy(const Vector& moments) const {
  const auto every_second = [&](Index from, Index count) {
    return Vector(Vector::Map(moments.data(), moments.size())(Eigen::seqN(from, count, 2)));
  };
  Turned turned{legendre_even_ * every_second(0, legendre_even_.cols()).asDiagonal() * legendre_even_.transpose(),
                legendre_odd_ * every_second(1, legendre_odd_.cols()).asDiagonal() * legendre_odd_.transpose()};
  const Vector integral = (turned.alike * root_of_flux_).cwiseQuotient(root_of_flux_);
  turned.alike.diagonal() -= integral;
  turned.unlike.diagonal() -= integral;
  return turned;
}

Matrix LayerModes::Loss(const Matrix& turned) const {
  Matrix m = -cut_.albedo * turned;
  m.diagonal() += cut_.absorbed * per_cosine_;
  return m;
}

// With u, v the sum and difference of the radiances down and up, and D = sqrt(cosine weight):
// d (D u) / d depth = -E (D v), d (D v) / d depth = -F (D u), both symmetric,
// E = (1 - albedo) / cosine - albedo unlike, F = (1 - albedo) / cosine - albedo alike.
LayerModes::LayerModes(const SlabLayer& layer, const Directions& d, int moments)
    : layer_(layer),
      cut_(CutPeak(layer, moments)),
      legendre_even_(d.size(), (moments + 1) / 2),
      legendre_odd_(d.size(), moments / 2),
      per_cosine_(d.cosine.cwiseInverse()),
      root_of_flux_(d.cosine.cwiseProduct(d.weight).cwiseSqrt()) {
  if (cut_.extinction_per_mm <= 0) return;
  const Index n = d.size();
  Vector before = Vector::Zero(n), now = d.weight.cwiseQuotient(d.cosine).cwiseSqrt();
  for (int l = 0; l < moments; ++l) {
    (l % 2 == 0 ? legendre_even_ : legendre_odd_).col(l / 2) = now;
    const Vector next = ((2 * l + 1) * d.cosine.cwiseProduct(now) - l * before) / (l + 1);
    before = now;
    now = next;
  }
  turned_ = TurnedBy(cut_.moments);
  const Eigen::LLT<Matrix> factors(Loss(turned_.unlike));  // E = L L'
  const Matrix lower = factors.matrixL();
  // L'FL has the modes as eigenvectors and their squared decays s as eigenvalues. Solvers are accurate relative to the
  // largest eigenvalue, and the s of grazing directions are too large for that; 1 / (1 + s) is small for those and at
  // most 1.
  Matrix one_plus = lower.transpose() * Loss(turned_.alike) * lower;
  one_plus.diagonal().array() += 1.0;
  const auto [values, vectors] = EigenOfSymmetric(one_plus.llt().solve(Matrix::Identity(n, n)));
  decay_ = (values.cwiseInverse().array() - 1.0).cwiseMax(0.0).sqrt();
  modes_ = factors.matrixU().solve(vectors);
  // The smallest decay governs what a thick layer transmits, and is much less than 1. It is computed as a Rayleigh
  // quotient in a form without cancellation: from absorption and from differences between directions.
  const Vector y = (lower * vectors.col(n - 1)).cwiseQuotient(root_of_flux_);
  double square = cut_.absorbed * y.cwiseAbs2().dot(d.weight);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < i; ++j)
      square += cut_.albedo * turned_.alike(i, j) * root_of_flux_[i] * root_of_flux_[j] * (y[i] - y[j]) * (y[i] - y[j]);
  decay_[n - 1] = std::sqrt(std::max(0.0, square));
}

Stack LayerModes::OfThickness(double thickness_mm) const {
  const Index n = root_of_flux_.size();
  const Matrix one = Matrix::Identity(n, n);
  const double half = 0.5 * cut_.extinction_per_mm * thickness_mm;
  if (half <= 0) return {Matrix::Zero(n, n), one, Matrix::Zero(n, n), one};
  const Matrix a = OnePlusRatio(modes_, ForEvery(decay_, half, LitAlike)).solve(one),
               b = OnePlusRatio(modes_, ForEvery(decay_, half, LitUnlike)).solve(one);
  const Vector back = root_of_flux_.cwiseInverse();
  Matrix reflect = back.asDiagonal() * (a + b - one) * root_of_flux_.asDiagonal(),
         transmit = back.asDiagonal() * (a - b) * root_of_flux_.asDiagonal();
  if (layer_.absorption_per_mm <= 0) {  // all incident light leaves, but for rounding errors
    const Vector flux = root_of_flux_.cwiseAbs2();
    const Vector kept = flux.cwiseQuotient((reflect + transmit).transpose() * flux);
    reflect *= kept.asDiagonal();
    transmit *= kept.asDiagonal();
  }
  Stack both{reflect, transmit, {}, {}};
  both.reflect_up = std::move(reflect);
  both.transmit_up = std::move(transmit);
  return both;
}

LayerModes::Change LayerModes::ChangeBy(const SlabLayer& change) const {
  const bool keeps_coefficients = change.scattering_per_mm == 0 && change.absorption_per_mm == 0;
  if (cut_.extinction_per_mm <= 0) {  // a clear layer does nothing at any thickness
    Check(keeps_coefficients, "a layer that scatters or absorbs before it changes in that");
    return {};
  }
  Change c{0.0, change.thickness_mm, {}, {}};
  if (keeps_coefficients && change.g == 0 && change.isotropic_fraction == 0) return c;
  const Cut cut = CutPeakChange(layer_, change, static_cast<int>(cut_.moments.size()));
  c.extinction_per_mm = cut.extinction_per_mm;
  Matrix alike = -cut.albedo * turned_.alike, unlike = -cut.albedo * turned_.unlike;
  alike.diagonal() -= cut.albedo * per_cosine_;
  unlike.diagonal() -= cut.albedo * per_cosine_;
  if (cut.moments.size() > 0) {
    const Turned turned = TurnedBy(cut.moments);
    alike -= cut_.albedo * turned.alike;
    unlike -= cut_.albedo * turned.unlike;
  }
  // In coordinates in which E is 1 and F diagonal.
  c.unlike = modes_.transpose() * unlike * modes_;
  const Matrix dual = Loss(turned_.unlike) * modes_;
  c.alike = dual.transpose() * alike * dual;
  return c;
}

// Divided differences in the modes (Daleckii and Krein 1965), here of a product of two matrices that both change:
// v / u = f(s) of E = 1 and F = diag(s). Where they become 1 + e and s + d, it is (1 + e)^-1 f((1 + e) (s + d)); its
// change has the elements (f_i - f_j) / (s_i - s_j) d_ij + (s_j f_i - s_i f_j) / (s_i - s_j) e_ij.
std::vector<Matrix> LayerModes::SeenChanges(double thickness_mm, const std::vector<Change>& changes,
                                            const Matrix& arriving, const Matrix& sights) const {
  const Index n = root_of_flux_.size();
  const double half = 0.5 * cut_.extinction_per_mm * thickness_mm;
  const Vector back = root_of_flux_.cwiseInverse(), square = decay_.cwiseAbs2();
  std::vector<Matrix> seen(changes.size(), Matrix::Zero(sights.cols(), arriving.cols()));
  for (const double sign : {1.0, -1.0}) {
    const std::vector<OfMode> f = sign > 0 ? ForEvery(decay_, half, LitAlike) : ForEvery(decay_, half, LitUnlike);
    const Eigen::LLT<Matrix> ratio = OnePlusRatio(modes_, f);
    const auto in_modes = [&](const Vector& scale, const Matrix& at) {
      const Matrix both_sides = scale.asDiagonal() * (at.topRows(n) + sign * at.bottomRows(n));
      return Matrix(modes_.transpose() * ratio.solve(both_sides));
    };
    const Matrix light = in_modes(root_of_flux_, arriving), sight = in_modes(back, sights);
    Matrix by_alike(n, n), by_unlike(n, n);
    Vector by_half(n);
    for (Index i = 0; i < n; ++i) {
      by_half[i] = f[i].by_half;
      for (Index j = 0; j <= i; ++j) {
        const double apart = square[i] - square[j];
        const double slope = std::abs(apart) > 1e-5 * (square[i] + square[j]) ? (f[i].value - f[j].value) / apart
                                                                              : 0.5 * (f[i].by_square + f[j].by_square);
        by_alike(i, j) = by_alike(j, i) = slope;
        by_unlike(i, j) = by_unlike(j, i) = square[j] * slope - f[j].value;
      }
    }
    for (size_t k = 0; k < changes.size(); ++k) {
      const Change& c = changes[k];
      const double d_half = 0.5 * (c.extinction_per_mm * thickness_mm + cut_.extinction_per_mm * c.thickness_mm);
      if (c.IsNone()) continue;
      Matrix ratio_change = Matrix::Zero(n, n);
      if (c.alike.size() > 0) ratio_change = by_alike.cwiseProduct(c.alike) + by_unlike.cwiseProduct(c.unlike);
      ratio_change.diagonal() += d_half * by_half;
      seen[k] -= sight.transpose() * ratio_change * light;
    }
  }
  return seen;
}

}  // namespace crownfit
