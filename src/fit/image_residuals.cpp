#include "fit/image_residuals.h"

#include <ceres/jet.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

constexpr int kFewSlots = 6;  // slots of most fits: derivatives by this many are twice as fast as by all

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
                               const std::vector<FitPixels>& pixels, const CalibrationState& calibration,
                               const ResidualOptions& options)
    : capture_(capture),
      state_(state),
      free_(free),
      pixels_(pixels),
      options_(options),
      nuisances_(capture, pixels, calibration),
      flat_(capture, free, options.threads) {
  for (const FitPixels& p : pixels_) {
    first_row_.push_back(rows_);
    rows_ += p.channels() * static_cast<int>(p.pixels.size());
    vertices_.push_back(VerticesAround(*state.crown, state.photographs[p.photograph], p.sources));
  }
  gathered_.resize((1 + nuisances_.lights().size()) * pixels_.size() * capture.channel_names.size());
}

void ImageResiduals::Predict(const Material& material, const std::vector<double>& light_scale, int group,
                             Eigen::Ref<Eigen::VectorXd> prediction) const {
  prediction.setZero();
  if (pixels_.empty()) return;  // measurements alone, without a crown
  std::vector<double> sharp;
  for (int c = 0; c < capture_.channels(); ++c) {
    const auto optics = OpticsFromSlots(capture_, SlotValues(capture_, material, state_, c));
    const DiffuserTable<double> table(optics.stack(), state_.crown->kernel.outer_radius_mm);
    for (size_t g = 0; g < pixels_.size(); ++g) {
      const FitPixels& p = pixels_[g];
      const PhotographCast& cast = state_.photographs[p.photograph];
      const PhotographSpec& photo = capture_.photographs[p.photograph];
      const auto at = [&](size_t i) -> double& {
        return prediction[first_row_[g] + p.channels() * static_cast<Eigen::Index>(i) + c];
      };
      if (group == 0 && !p.scenery.empty())
        for (size_t i = 0; i < p.pixels.size(); ++i) at(i) = p.scenery[i][c];
      if (std::none_of(photo.lights.begin(), photo.lights.end(), [&](size_t l) { return light_scale[l] > 0; }))
        continue;
      const ShaderPrediction<double> model(*state_.crown, cast, optics, table, c, light_scale, vertices_[g],
                                           options_.threads, &GatheredOf(group, g, c));
      const Polarisers polarisers = photo.polarisers();
      sharp.resize(p.sources.size());
      ParallelFor(sharp.size(), options_.threads,
                  [&](size_t i) { sharp[i] = model.Pixel(cast.pixels[p.sources[i]], polarisers); });
      for (size_t i = 0; i < p.pixels.size(); ++i)
        for (const auto& [source, weight] : p.TermsOf(i)) at(i) += weight * sharp[source];
    }
  }
}

Eigen::MatrixXd ImageResiduals::PredictPerScale(const Material& material) const {
  const std::vector<int>& lights = nuisances_.lights();
  Eigen::MatrixXd parts(rows_, 1 + static_cast<int>(lights.size()));
  for (int g = 0; g < parts.cols(); ++g) {
    std::vector<double> scale = StatedLightScales(capture_);
    for (size_t l = 0; l < scale.size(); ++l) {
      const auto at = std::find(lights.begin(), lights.end(), static_cast<int>(l));
      const int group = at == lights.end() ? 0 : 1 + static_cast<int>(at - lights.begin());
      if (group != g)
        scale[l] = 0.0;
      else if (group > 0)
        scale[l] = 1.0;
    }
    Predict(material, scale, g, parts.col(g));
  }
  return parts;
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
  const auto derivatives = SlotDerivatives(capture_, state_);
  const Eigen::VectorXd addition = nuisances_.Addition(scales);
  for (int c = 0; c < capture_.channels(); ++c) {
    const auto values = SlotValues(capture_, material, state_, c);
    std::array<Jet, kShaderSlots> jets;
    std::transform(values.begin(), values.end(), jets.begin(), [](double v) { return Jet(v); });
    Eigen::Matrix<double, kJetSize, Eigen::Dynamic> slot_by_x(kJetSize, free_.count());
    slot_by_x.setZero();
    for (size_t i = 0; i < moved.size(); ++i) {
      const int s = moved[i];
      jets[s] = Jet(values[s], static_cast<int>(i));
      slot_by_x.row(static_cast<int>(i)) =
          derivatives[s] * ValueGradient(free_, x, slots[s]->layer, slots[s]->quantity, c);
    }
    const auto optics = OpticsFromSlots(capture_, jets);
    const DiffuserTable<Jet> table(optics.stack(), state_.crown->kernel.outer_radius_mm);
    for (size_t g = 0; g < pixels_.size(); ++g) {
      const FitPixels& p = pixels_[g];
      const PhotographCast& cast = state_.photographs[p.photograph];
      const Polarisers polarisers = capture_.photographs[p.photograph].polarisers();
      const double exposure = nuisances_.ExposureOf(p, scales);
      GatheredLight* same = nuisances_.lights().empty() ? &GatheredOf(0, g, c) : nullptr;
      const ShaderPrediction<Jet> model(*state_.crown, cast, optics, table, c, scales.light, vertices_[g],
                                        options_.threads, same);
      std::vector<Jet> sharp(p.sources.size());
      ParallelFor(sharp.size(), options_.threads,
                  [&](size_t i) { sharp[i] = model.Pixel(cast.pixels[p.sources[i]], polarisers); });
      ParallelFor(p.pixels.size(), options_.threads, [&](size_t i) {
        const int k = first_row_[g] + p.channels() * static_cast<int>(i) + c;
        Jet value(p.SceneryAt(i)[c]);
        for (const auto& [source, weight] : p.TermsOf(i)) value += static_cast<double>(weight) * sharp[source];
        const double factor = exposure / p.stddev[i][c];
        out.residuals[k] = factor * (value.a + addition[k]) - p.values[i][c] / p.stddev[i][c];
        out.jacobian.row(k).noalias() = factor * (value.v.transpose() * slot_by_x);
      });
    }
  }
}

Evaluation ImageResiduals::Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const {
  Evaluation out;
  if (last_.parts.size() == 0 || last_.x != x) last_ = {x, PredictPerScale(MaterialAt(free_, x))};
  const Eigen::MatrixXd& parts = last_.parts;
  out.finite = parts.allFinite();
  if (!out.finite) return out;
  out.scales = nuisances_.Solve(parts, options_.huber_width);
  out.residuals.resize(count());
  if (with_jacobian) out.jacobian.setZero(count(), free_.count());
  if (with_jacobian && rows_ > 0) {
    PredictWithDerivatives(x, out.scales, out);
  } else {
    out.residuals.head(rows_) = nuisances_.Residuals(nuisances_.Prediction(parts, out.scales), out.scales);
  }
  const int of_photographs = rows_ + nuisances_.count();
  out.residuals.segment(rows_, nuisances_.count()) = nuisances_.PriorResiduals(out.scales);
  if (flat_.count() > 0) {
    const FlatResiduals::Evaluation flat = flat_.Evaluate(x, with_jacobian);
    out.residuals.tail(flat_.count()) = flat.residuals;
    if (with_jacobian) out.jacobian.bottomRows(flat_.count()) = flat.jacobian;
  }
  out.finite = out.residuals.allFinite() && (!with_jacobian || out.jacobian.allFinite());
  if (!out.finite) return out;

  const double width = options_.huber_width;
  out.robust = out.residuals;
  out.robust.head(rows_) = out.residuals.head(rows_).unaryExpr([&](double r) { return Robust(r, width); });
  if (!with_jacobian) return out;
  const Eigen::VectorXd slope = out.residuals.head(rows_).unaryExpr([&](double r) { return RobustSlope(r, width); });
  out.jacobian.topRows(rows_) = slope.asDiagonal() * out.jacobian.topRows(rows_);
  if (nuisances_.count() > 0) nuisances_.Project(parts, out.scales, slope, out.jacobian.topRows(of_photographs));
  return out;
}

}  // namespace crownfit
