#include "fit/image_residuals.h"

#include <ceres/jet.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"

namespace crownfit {
namespace {

constexpr int kFewSlots = 6;  // that most fits move: derivatives by as many are twice as quick as by all

/// Huber's loss as a residual: its square is rho(r^2), so plain least squares minimises the robust sum.
double Robust(double r, double width) {
  if (width <= 0 || std::abs(r) <= width) return r;
  return std::copysign(std::sqrt(2 * width * std::abs(r) - width * width), r);
}

double RobustSlope(double r, double width) {
  if (width <= 0 || std::abs(r) <= width) return 1.0;
  return width / std::abs(Robust(r, width));
}

}  // namespace

ImageResiduals::ImageResiduals(const Capture& capture, const CastState& state, const FreeParameters& free,
                               const std::vector<FitPixels>& pixels, const ResidualOptions& options)
    : capture_(capture), state_(state), free_(free), pixels_(pixels), options_(options) {
  std::vector<char> used(capture.lights.size(), 0);
  for (const FitPixels& p : pixels_) {
    count_ += kChannels * static_cast<int>(p.pixels.size());
    free_exposures_ = std::max(free_exposures_, p.exposure + 1);
    for (size_t light : capture.photographs[p.photograph].lights) used[light] = 1;
    vertices_.push_back(VerticesAround(*state.crown, state.photographs[p.photograph], p.sources));
  }
  for (size_t l = 0; l < capture.lights.size(); ++l)
    if (capture.lights[l].scale_is_free && used[l]) free_lights_.push_back(static_cast<int>(l));
}

double ImageResiduals::ExposureOf(const FitPixels& p, const LinearScales& scales) const {
  return p.exposure < 0 ? capture_.photographs[p.photograph].exposure_scale : scales.exposure[p.exposure];
}

void ImageResiduals::Predict(const Material& material, const std::vector<double>& light_scale, bool with_scenery,
                             Eigen::VectorXd& prediction) const {
  prediction.resize(count_);
  std::vector<double> sharp;
  int row = 0;
  for (size_t g = 0; g < pixels_.size(); ++g) {
    const FitPixels& p = pixels_[g];
    const PhotographCast& cast = state_.photographs[p.photograph];
    const double specular = SpecularFactor(capture_.photographs[p.photograph].polarisation);
    for (int c = 0; c < kChannels; ++c) {
      const auto optics = OpticsFromSlots(capture_, SlotValues(capture_, material, state_, c));
      const DiffuserTable<double> table(optics.stack(), state_.crown->kernel.outer_radius_mm);
      const ShaderPrediction<double> model(*state_.crown, cast, optics, table, c, light_scale, vertices_[g],
                                           options_.threads);
      sharp.resize(p.sources.size());
      ParallelFor(sharp.size(), options_.threads,
                  [&](size_t i) { sharp[i] = model.Pixel(cast.pixels[p.sources[i]], specular); });
      for (size_t i = 0; i < p.pixels.size(); ++i) {
        double sum = with_scenery && !p.scenery.empty() ? p.scenery[i][c] : 0.0;
        for (int t = p.first_term[i]; t < p.first_term[i + 1]; ++t) sum += p.terms[t].weight * sharp[p.terms[t].source];
        prediction[row + kChannels * static_cast<int>(i) + c] = sum;
      }
    }
    row += kChannels * static_cast<int>(p.pixels.size());
  }
}

Eigen::MatrixXd ImageResiduals::PredictPerScale(const Material& material) const {
  // Column 0: all lights of fixed scale; then one column per free light at scale 1.
  Eigen::MatrixXd parts(count_, 1 + static_cast<int>(free_lights_.size()));
  Eigen::VectorXd column;
  for (int g = 0; g < parts.cols(); ++g) {
    std::vector<double> scale = StatedLightScales(capture_);
    for (size_t l = 0; l < scale.size(); ++l) {
      const auto at = std::find(free_lights_.begin(), free_lights_.end(), static_cast<int>(l));
      const int group = at == free_lights_.end() ? 0 : 1 + static_cast<int>(at - free_lights_.begin());
      if (group != g)
        scale[l] = 0.0;
      else if (group > 0)
        scale[l] = 1.0;
    }
    Predict(material, scale, /*with_scenery=*/g == 0, column);
    parts.col(g) = column;
  }
  return parts;
}

LinearScales ImageResiduals::SolveScales(const Eigen::MatrixXd& parts) const {
  LinearScales scales;
  scales.light = StatedLightScales(capture_);
  scales.exposure.assign(free_exposures_, 1.0);
  if (free_exposures_ == 0 && free_lights_.empty()) return scales;
  for (const FitPixels& p : pixels_)
    if (p.exposure >= 0) scales.exposure[p.exposure] = capture_.photographs[p.photograph].exposure_scale;

  // Alternate between the exposures and the light scales, each a linear least-squares problem with Huber weights taken
  // from the round before. One kind alone is exact once the weights settle.
  const int lights = static_cast<int>(free_lights_.size());
  for (int round = 0; round < 30; ++round) {
    const LinearScales before = scales;
    Eigen::VectorXd top = Eigen::VectorXd::Zero(free_exposures_), bottom = top;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(lights, lights);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(lights);
    for (const bool exposures_now : {true, false}) {
      int row = 0;
      for (const FitPixels& p : pixels_) {
        const double exposure = ExposureOf(p, scales);
        for (size_t i = 0; i < p.pixels.size(); ++i) {
          for (int c = 0; c < kChannels; ++c, ++row) {
            double m = parts(row, 0);
            for (int g = 0; g < lights; ++g) m += scales.light[free_lights_[g]] * parts(row, 1 + g);
            const double y = p.values[i][c], sigma = p.stddev[i][c], r = (exposure * m - y) / sigma;
            const bool linear = options_.huber_width > 0 && std::abs(r) > options_.huber_width;
            const double w = (linear ? options_.huber_width / std::abs(r) : 1.0) / (sigma * sigma);
            if (exposures_now && p.exposure >= 0) {
              top[p.exposure] += w * y * m;
              bottom[p.exposure] += w * m * m;
            } else if (!exposures_now) {
              for (int g = 0; g < lights; ++g) {
                const double a = exposure * parts(row, 1 + g);
                right[g] += w * a * (y - exposure * parts(row, 0));
                for (int h = 0; h < lights; ++h) normal(g, h) += w * a * exposure * parts(row, 1 + h);
              }
            }
          }
        }
      }
      if (exposures_now) {
        for (int e = 0; e < free_exposures_; ++e)
          if (bottom[e] > 0) scales.exposure[e] = std::max(1e-9, top[e] / bottom[e]);
      } else if (lights > 0) {
        const Eigen::VectorXd s = normal.completeOrthogonalDecomposition().solve(right);
        for (int g = 0; g < lights; ++g) scales.light[free_lights_[g]] = std::max(1e-9, s[g]);
      }
    }
    double change = 0;
    for (int e = 0; e < free_exposures_; ++e)
      change = std::max(change, std::abs(scales.exposure[e] / before.exposure[e] - 1.0));
    for (int l : free_lights_) change = std::max(change, std::abs(scales.light[l] / before.light[l] - 1.0));
    if (change < 1e-12) break;
  }
  return scales;
}

void ImageResiduals::PredictWithDerivatives(const Eigen::VectorXd& x, const LinearScales& scales,
                                            Evaluation& out) const {
  std::vector<int> moved;  // slots that an entry of x moves
  const auto slots = SlotsOf(capture_);
  for (int s = 0; s < kShaderSlots; ++s) {
    bool moves = false;
    for (const FreeEntry& e : free_.entries)
      moves |= slots[s] && slots[s]->layer == e.layer && slots[s]->quantity == e.quantity;
    if (moves) moved.push_back(s);
  }
  if (moved.size() <= kFewSlots) {
    PredictWithDerivativesBy<kFewSlots>(moved, x, scales, out);
  } else {
    PredictWithDerivativesBy<kShaderSlots>(moved, x, scales, out);
  }
}

template <int kJetSize>
void ImageResiduals::PredictWithDerivativesBy(const std::vector<int>& moved, const Eigen::VectorXd& x,
                                              const LinearScales& scales, Evaluation& out) const {
  using Jet = ceres::Jet<double, kJetSize>;
  const Material material = MaterialAt(free_, x);
  const auto slots = SlotsOf(capture_);
  const auto slopes = SlotSlopes(capture_, state_);
  int row = 0;
  for (size_t g = 0; g < pixels_.size(); ++g) {
    const FitPixels& p = pixels_[g];
    const PhotographCast& cast = state_.photographs[p.photograph];
    const double specular = SpecularFactor(capture_.photographs[p.photograph].polarisation);
    const double exposure = ExposureOf(p, scales);
    for (int c = 0; c < kChannels; ++c) {
      const auto values = SlotValues(capture_, material, state_, c);
      std::array<Jet, kShaderSlots> jets;
      std::transform(values.begin(), values.end(), jets.begin(), [](double v) { return Jet(v); });
      Eigen::Matrix<double, kJetSize, Eigen::Dynamic> slot_by_x(kJetSize, free_.count());
      slot_by_x.setZero();
      for (size_t i = 0; i < moved.size(); ++i) {
        const int s = moved[i];
        jets[s] = Jet(values[s], static_cast<int>(i));
        slot_by_x.row(static_cast<int>(i)) =
            slopes[s] * ValueGradient(free_, x, slots[s]->layer, slots[s]->quantity, c);
      }
      const auto optics = OpticsFromSlots(capture_, jets);
      const DiffuserTable<Jet> table(optics.stack(), state_.crown->kernel.outer_radius_mm);
      const ShaderPrediction<Jet> model(*state_.crown, cast, optics, table, c, scales.light, vertices_[g],
                                        options_.threads);
      std::vector<Jet> sharp(p.sources.size());
      ParallelFor(sharp.size(), options_.threads,
                  [&](size_t i) { sharp[i] = model.Pixel(cast.pixels[p.sources[i]], specular); });
      ParallelFor(p.pixels.size(), options_.threads, [&](size_t i) {
        const int k = row + kChannels * static_cast<int>(i) + c;
        Jet value(p.scenery.empty() ? 0.0 : p.scenery[i][c]);
        for (int t = p.first_term[i]; t < p.first_term[i + 1]; ++t)
          value += static_cast<double>(p.terms[t].weight) * sharp[p.terms[t].source];
        const double factor = exposure / p.stddev[i][c];
        out.residuals[k] = factor * value.a - p.values[i][c] / p.stddev[i][c];
        out.jacobian.row(k).noalias() = factor * (value.v.transpose() * slot_by_x);
      });
    }
    row += kChannels * static_cast<int>(p.pixels.size());
  }
}

Evaluation ImageResiduals::Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const {
  Evaluation out;
  const Material material = MaterialAt(free_, x);
  const bool linear = free_exposures_ > 0 || !free_lights_.empty();
  Eigen::MatrixXd parts;
  if (linear || !with_jacobian) parts = PredictPerScale(material);
  out.finite = parts.allFinite();
  if (!out.finite) return out;
  out.scales = SolveScales(parts);
  out.residuals.resize(count_);
  if (with_jacobian) {
    out.jacobian.resize(count_, free_.count());
    PredictWithDerivatives(x, out.scales, out);
  } else {
    Eigen::VectorXd prediction = parts.col(0);
    for (size_t g = 0; g < free_lights_.size(); ++g)
      prediction += out.scales.light[free_lights_[g]] * parts.col(1 + static_cast<int>(g));
    int row = 0;
    for (const FitPixels& p : pixels_)
      for (size_t i = 0; i < p.pixels.size(); ++i)
        for (int c = 0; c < kChannels; ++c, ++row)
          out.residuals[row] = (ExposureOf(p, out.scales) * prediction[row] - p.values[i][c]) / p.stddev[i][c];
  }
  out.finite = out.residuals.allFinite() && (!with_jacobian || out.jacobian.allFinite());
  if (!out.finite) return out;

  const double width = options_.huber_width;
  out.robust = out.residuals.unaryExpr([&](double r) { return Robust(r, width); });
  if (!with_jacobian) return out;
  const Eigen::VectorXd slope = out.residuals.unaryExpr([&](double r) { return RobustSlope(r, width); });
  out.jacobian = slope.asDiagonal() * out.jacobian;
  if (!linear) return out;

  Eigen::MatrixXd nuisance = Eigen::MatrixXd::Zero(count_, free_exposures_ + static_cast<int>(free_lights_.size()));
  int row = 0;
  for (const FitPixels& p : pixels_) {
    const double exposure = ExposureOf(p, out.scales);
    for (size_t i = 0; i < p.pixels.size(); ++i) {
      for (int c = 0; c < kChannels; ++c, ++row) {
        const double w = slope[row] / p.stddev[i][c];
        double m = parts(row, 0);
        for (size_t g = 0; g < free_lights_.size(); ++g) {
          const double part = parts(row, 1 + static_cast<int>(g));
          m += out.scales.light[free_lights_[g]] * part;
          nuisance(row, free_exposures_ + static_cast<int>(g)) = w * exposure * part;
        }
        if (p.exposure >= 0) nuisance(row, p.exposure) = w * m;
      }
    }
  }
  const Eigen::MatrixXd gram = nuisance.transpose() * nuisance;
  const Eigen::MatrixXd cross = nuisance.transpose() * out.jacobian;
  out.jacobian -= nuisance * gram.completeOrthogonalDecomposition().solve(cross);
  return out;
}

}  // namespace crownfit
