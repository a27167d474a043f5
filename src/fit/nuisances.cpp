#include "fit/nuisances.h"

#include <algorithm>
#include <cmath>

#include "base/linear_algebra.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

int RowsOf(const FitPixels& p) { return p.channels() * static_cast<int>(p.pixels.size()); }

}  // namespace

Nuisances::Nuisances(const Capture& capture, const std::vector<FitPixels>& pixels, const CalibrationState& calibration)
    : capture_(capture), pixels_(pixels), calibration_(calibration) {
  std::vector<char> used(capture.lights.size(), 0);
  std::vector<double> sharpness;
  for (const FitPixels& p : pixels_) {
    rows_ += RowsOf(p);
    for (size_t light : capture.photographs[p.photograph].lights) used[light] = 1;
    if (p.exposure < exposures_) continue;
    const PhotographSpec& spec = capture.photographs[p.photograph];
    exposures_ = p.exposure + 1;
    first_photograph_.push_back(p.photograph);
    sharpness.push_back(spec.exposure_stddev > 0 ? 1.0 / spec.exposure_stddev : 0.0);
  }
  for (size_t l = 0; l < capture.lights.size(); ++l) {
    const Light& light = capture.lights[l];
    if (!used[l] || (!light.scale_is_free && light.intensity_stddev <= 0)) continue;
    lights_.push_back(static_cast<int>(l));
    sharpness.push_back(light.scale_is_free ? 0.0 : 1.0 / light.intensity_stddev);
  }
  if (!calibration.derivatives.empty()) errors_ = static_cast<int>(calibration.amounts.size());
  sharpness.resize(sharpness.size() + errors_, 1.0);
  sharpness_ = Eigen::Map<const Eigen::VectorXd>(sharpness.data(), static_cast<Eigen::Index>(sharpness.size()));
}

LinearScales Nuisances::Stated() const {
  LinearScales scales;
  for (size_t photograph : first_photograph_)
    scales.exposure.push_back(capture_.photographs[photograph].exposure_scale);
  for (const Light& light : capture_.lights) scales.light.push_back(light.intensity_scale);
  scales.calibration.assign(errors_, 0.0);
  return scales;
}

double Nuisances::ExposureOf(const FitPixels& p, const LinearScales& scales) const {
  return p.exposure < 0 ? capture_.photographs[p.photograph].exposure_scale : scales.exposure[p.exposure];
}

Eigen::VectorXd Nuisances::Addition(const LinearScales& scales) const {
  Eigen::VectorXd addition = Eigen::VectorXd::Zero(rows_);
  int row = 0;
  for (size_t g = 0; g < pixels_.size(); row += RowsOf(pixels_[g]), ++g) {
    if (errors_ == 0) continue;
    const CalibrationDerivatives& derivatives = calibration_.derivatives[g];
    for (size_t k = 0; k < derivatives.errors.size(); ++k)
      addition.segment(row, RowsOf(pixels_[g])) +=
          scales.calibration[derivatives.errors[k]] * derivatives.by_error.col(static_cast<Eigen::Index>(k));
  }
  return addition;
}

Eigen::VectorXd Nuisances::Prediction(const Eigen::MatrixXd& parts, const LinearScales& scales) const {
  Eigen::VectorXd prediction = parts.col(0) + Addition(scales);
  for (size_t g = 0; g < lights_.size(); ++g)
    prediction += scales.light[lights_[g]] * parts.col(1 + static_cast<Eigen::Index>(g));
  return prediction;
}

Eigen::VectorXd Nuisances::Residuals(const Eigen::VectorXd& prediction, const LinearScales& scales) const {
  Eigen::VectorXd residuals(rows_);
  int row = 0;
  for (const FitPixels& p : pixels_) {
    const double exposure = ExposureOf(p, scales);
    for (size_t i = 0; i < p.pixels.size(); ++i)
      for (int c = 0; c < p.channels(); ++c, ++row)
        residuals[row] = (exposure * prediction[row] - p.values[i][c]) / p.stddev[i][c];
  }
  return residuals;
}

Eigen::VectorXd Nuisances::PriorResiduals(const LinearScales& scales) const {
  const LinearScales stated = Stated();
  Eigen::VectorXd away(count());
  int k = 0;
  for (int e = 0; e < exposures_; ++e) away[k++] = scales.exposure[e] - stated.exposure[e];
  for (int l : lights_) away[k++] = scales.light[l] - stated.light[l];
  for (int e = 0; e < errors_; ++e) away[k++] = calibration_.amounts[e] + scales.calibration[e];
  return sharpness_.cwiseProduct(away);
}

std::vector<Nuisances::Block> Nuisances::Blocks(const Eigen::MatrixXd& parts, const LinearScales& scales) const {
  const Eigen::VectorXd prediction = Prediction(parts, scales);
  std::vector<Block> blocks;
  int row = 0;
  for (size_t g = 0; g < pixels_.size(); row += RowsOf(pixels_[g]), ++g) {
    const FitPixels& p = pixels_[g];
    const int rows = RowsOf(p);
    const double exposure = ExposureOf(p, scales);
    Block block{row, {}, {}};
    const auto lights = static_cast<int>(lights_.size());
    if (p.exposure >= 0) block.columns.push_back(p.exposure);
    for (int l = 0; l < lights; ++l) block.columns.push_back(exposures_ + l);
    if (errors_ > 0)
      for (int e : calibration_.derivatives[g].errors) block.columns.push_back(exposures_ + lights + e);
    block.by_column.resize(rows, static_cast<Eigen::Index>(block.columns.size()));
    int column = 0;
    if (p.exposure >= 0) block.by_column.col(column++) = prediction.segment(row, rows);
    for (int l = 0; l < lights; ++l) block.by_column.col(column++) = exposure * parts.col(1 + l).segment(row, rows);
    if (errors_ > 0)
      block.by_column.rightCols(calibration_.derivatives[g].by_error.cols()) =
          exposure * calibration_.derivatives[g].by_error;
    for (size_t i = 0; i < p.pixels.size(); ++i)
      for (int c = 0; c < p.channels(); ++c)
        block.by_column.row(p.channels() * static_cast<Eigen::Index>(i) + c) /= p.stddev[i][c];
    blocks.push_back(std::move(block));
  }
  return blocks;
}

/// Exact where only one kind of factor is free; otherwise the start from which Gauss-Newton finds both.
void Nuisances::SetExposuresAlone(const Eigen::MatrixXd& parts, LinearScales& scales) const {
  const Eigen::VectorXd prediction = Prediction(parts, scales);
  Eigen::VectorXd top = Eigen::VectorXd::Zero(exposures_), bottom = top;
  int row = 0;
  for (const FitPixels& p : pixels_)
    for (size_t i = 0; i < p.pixels.size(); ++i)
      for (int c = 0; c < p.channels(); ++c, ++row) {
        if (p.exposure < 0) continue;
        const double w = 1.0 / (p.stddev[i][c] * p.stddev[i][c]);
        top[p.exposure] += w * p.values[i][c] * prediction[row];
        bottom[p.exposure] += w * prediction[row] * prediction[row];
      }
  for (int e = 0; e < exposures_; ++e)
    if (bottom[e] > 0 && sharpness_[e] == 0) scales.exposure[e] = std::max(1e-9, top[e] / bottom[e]);
}

LinearScales Nuisances::Solve(const Eigen::MatrixXd& parts, double huber_width) const {
  LinearScales scales = Stated();
  if (count() == 0) return scales;
  SetExposuresAlone(parts, scales);
  scales.settled = false;
  for (int round = 0; round < 30; ++round) {
    const Eigen::VectorXd residuals = Residuals(Prediction(parts, scales), scales);
    const Eigen::VectorXd weights = residuals.unaryExpr(
        [&](double r) { return huber_width > 0 && std::abs(r) > huber_width ? huber_width / std::abs(r) : 1.0; });
    Eigen::MatrixXd normal = sharpness_.cwiseAbs2().asDiagonal();
    Eigen::VectorXd right = -sharpness_.cwiseProduct(PriorResiduals(scales));
    for (const Block& block : Blocks(parts, scales)) {
      const auto rows = block.by_column.rows();
      const Eigen::MatrixXd weighted = weights.segment(block.first_row, rows).asDiagonal() * block.by_column;
      normal(block.columns, block.columns) += weighted.transpose() * block.by_column;
      right(block.columns) -= weighted.transpose() * residuals.segment(block.first_row, rows);
    }
    const Eigen::VectorXd step = ShortestNearest(normal, right);
    double change = 0;
    int k = 0;
    const auto move_factor = [&](double& factor) {  // and keeps it positive
      const double next = std::max(0.1 * factor, factor + step[k++]);
      change = std::max(change, std::abs(next / factor - 1.0));
      factor = next;
    };
    for (double& exposure : scales.exposure) move_factor(exposure);
    for (int l : lights_) move_factor(scales.light[l]);
    for (double& amount : scales.calibration) {
      change = std::max(change, std::abs(step[k]));
      amount += step[k++];
    }
    scales.settled = change < 1e-10;
    if (scales.settled) break;
  }
  return scales;
}

void Nuisances::Project(
    const Eigen::MatrixXd& parts, const LinearScales& scales, const Eigen::VectorXd& slope,
    Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian) const {
  std::vector<Block> blocks = Blocks(parts, scales);
  Eigen::MatrixXd gram = sharpness_.cwiseAbs2().asDiagonal();
  Eigen::MatrixXd cross = Eigen::MatrixXd::Zero(count(), jacobian.cols());
  for (Block& block : blocks) {
    const auto rows = block.by_column.rows();
    block.by_column = slope.segment(block.first_row, rows).asDiagonal() * block.by_column;
    gram(block.columns, block.columns) += block.by_column.transpose() * block.by_column;
    cross(block.columns, Eigen::all) += block.by_column.transpose() * jacobian.middleRows(block.first_row, rows);
  }
  const Eigen::MatrixXd share = ShortestNearest(gram, cross);
  for (const Block& block : blocks)
    jacobian.middleRows(block.first_row, block.by_column.rows()) -= block.by_column * share(block.columns, Eigen::all);
  jacobian.bottomRows(count()) -= sharpness_.asDiagonal() * share;
}

}  // namespace crownfit
