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

std::vector<int> ImageResiduals::MovedSlots() const {
  std::vector<int> moved;
  const auto slots = SlotsOf(capture_);
  for (int s = 0; s < kShaderSlots; ++s) {
    const bool moves = slots[s] && std::ranges::any_of(free_.entries, [&](const FreeEntry& e) {
                         return slots[s]->layer == e.layer && slots[s]->quantity == e.quantity;
                       });
    if (moves) moved.push_back(s);
  }
  return moved;
}

void ImageResiduals::Linearise(const Material& material, const LinearScales& scales, const std::vector<int>& moved,
                               LinearisedPrediction& out) const {
  out.value.resize(rows_);
  out.by_slot.setZero(rows_, kShaderSlots);
  if (moved.size() <= kFewSlots) {
    LineariseBy<kFewSlots>(moved, material, scales, out);
  } else {
    LineariseBy<kShaderSlots>(moved, material, scales, out);
  }
}

template <int kJetSize>
void ImageResiduals::LineariseBy(const std::vector<int>& moved, const Material& material, const LinearScales& scales,
                                 LinearisedPrediction& out) const {
  using Jet = ceres::Jet<double, kJetSize>;
  for (int c = 0; c < capture_.channels(); ++c) {
    const auto values = SlotValues(capture_, material, state_, c);
    std::array<Jet, kShaderSlots> jets;
    std::transform(values.begin(), values.end(), jets.begin(), [](double v) { return Jet(v); });
    for (size_t i = 0; i < moved.size(); ++i) jets[moved[i]] = Jet(values[moved[i]], static_cast<int>(i));
    const auto optics = OpticsFromSlots(capture_, jets);
    const DiffuserTable<Jet> table(optics.stack(), state_.crown->kernel.outer_radius_mm);
    for (size_t g = 0; g < pixels_.size(); ++g) {
      const FitPixels& p = pixels_[g];
      const PhotographCast& cast = state_.photographs[p.photograph];
      const Polarisers polarisers = capture_.photographs[p.photograph].polarisers();
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
        out.value[k] = value.a;
        for (size_t s = 0; s < moved.size(); ++s) out.by_slot(k, moved[s]) = value.v[static_cast<int>(s)];
      });
    }
  }
}

void ImageResiduals::Differentiate(const LinearisedPrediction& there, const Eigen::VectorXd& x, Evaluation& out) const {
  const auto slots = SlotsOf(capture_);
  const auto derivatives = SlotDerivatives(capture_, state_);
  const std::vector<int> moved = MovedSlots();
  const Eigen::VectorXd addition = nuisances_.Addition(out.scales);
  for (int c = 0; c < capture_.channels(); ++c) {
    Eigen::MatrixXd slot_by_x = Eigen::MatrixXd::Zero(kShaderSlots, free_.count());
    for (const int s : moved)
      slot_by_x.row(s) = derivatives[s] * ValueGradient(free_, x, slots[s]->layer, slots[s]->quantity, c);
    for (size_t g = 0; g < pixels_.size(); ++g) {
      const FitPixels& p = pixels_[g];
      const double exposure = nuisances_.ExposureOf(p, out.scales);
      ParallelFor(p.pixels.size(), options_.threads, [&](size_t i) {
        const int k = first_row_[g] + p.channels() * static_cast<int>(i) + c;
        const double factor = exposure / p.stddev[i][c];
        out.residuals[k] = factor * (there.value[k] + addition[k]) - p.values[i][c] / p.stddev[i][c];
        out.jacobian.row(k).noalias() = factor * (there.by_slot.row(k) * slot_by_x);
      });
    }
  }
}

LinearisedPrediction ImageResiduals::Linearise(const Eigen::VectorXd& x) const {
  const auto slots = SlotsOf(capture_);
  std::vector<int> all;
  for (int s = 0; s < kShaderSlots; ++s)
    if (slots[s]) all.push_back(s);
  const Material material = MaterialAt(free_, x);
  LinearisedPrediction out;
  out.parts = PredictPerScale(material);
  if (out.parts.allFinite() && rows_ > 0)
    Linearise(material, nuisances_.Solve(out.parts, options_.huber_width), all, out);
  return out;
}

Evaluation ImageResiduals::EvaluateBy(const LinearisedPrediction& there, const Eigen::VectorXd& x) const {
  Evaluation out;
  out.finite = there.parts.allFinite();
  if (!out.finite) return out;
  out.scales = nuisances_.Solve(there.parts, options_.huber_width);
  out.residuals.resize(count());
  out.jacobian.setZero(count(), free_.count());
  if (rows_ > 0) Differentiate(there, x, out);
  Complete(there.parts, x, true, out);
  return out;
}

Evaluation ImageResiduals::Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const {
  const Material material = MaterialAt(free_, x);
  if (last_.parts.size() == 0 || last_.x != x) last_ = {x, PredictPerScale(material)};
  const Eigen::MatrixXd& parts = last_.parts;
  Evaluation out;
  out.finite = parts.allFinite();
  if (!out.finite) return out;
  out.scales = nuisances_.Solve(parts, options_.huber_width);
  out.residuals.resize(count());
  if (with_jacobian) out.jacobian.setZero(count(), free_.count());
  if (with_jacobian && rows_ > 0) {
    LinearisedPrediction here;
    Linearise(material, out.scales, MovedSlots(), here);
    Differentiate(here, x, out);
  } else {
    out.residuals.head(rows_) = nuisances_.Residuals(nuisances_.Prediction(parts, out.scales), out.scales);
  }
  Complete(parts, x, with_jacobian, out);
  return out;
}

void ImageResiduals::Complete(const Eigen::MatrixXd& parts, const Eigen::VectorXd& x, bool with_jacobian,
                              Evaluation& out) const {
  const int of_photographs = rows_ + nuisances_.count();
  out.residuals.segment(rows_, nuisances_.count()) = nuisances_.PriorResiduals(out.scales);
  if (flat_.count() > 0) {
    const FlatResiduals::Evaluation flat = flat_.Evaluate(x, with_jacobian);
    out.residuals.tail(flat_.count()) = flat.residuals;
    if (with_jacobian) out.jacobian.bottomRows(flat_.count()) = flat.jacobian;
  }
  out.finite = out.residuals.allFinite() && (!with_jacobian || out.jacobian.allFinite());
  if (!out.finite) return;

  const double width = options_.huber_width;
  out.robust = out.residuals;
  out.robust.head(rows_) = out.residuals.head(rows_).unaryExpr([&](double r) { return Robust(r, width); });
  if (!with_jacobian) return;
  const Eigen::VectorXd slope = out.residuals.head(rows_).unaryExpr([&](double r) { return RobustSlope(r, width); });
  out.jacobian.topRows(rows_) = slope.asDiagonal() * out.jacobian.topRows(rows_);
  if (nuisances_.count() > 0) nuisances_.Project(parts, out.scales, slope, out.jacobian.topRows(of_photographs));
}

}  // namespace crownfit
