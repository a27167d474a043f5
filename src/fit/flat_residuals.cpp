#include "fit/flat_residuals.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "base/parallel.h"
#include "capture/capture.h"
#include "optics/aperture.h"
#include "optics/flat_reading.h"

namespace crownfit {
namespace {

constexpr double kStep = 1e-4;  // in ln, or in the unit: rounding and curvature both stay below 1e-7

/// Readings of several measurements in each band.
using Bands = std::vector<std::vector<BandReading>>;

Eigen::VectorXd Values(const FlatMeasurement& m, std::span<const BandReading> bands) {
  const std::vector<double> values = PredictedValues(m, bands);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Eigen::VectorXd Values(const FlatMeasurement& m, const Bands& bands, size_t number) {
  std::vector<BandReading> of_sample;
  for (const std::vector<BandReading>& band : bands) of_sample.push_back(band[number]);
  return Values(m, of_sample);
}

/// One over the standard deviation of every value.
Eigen::VectorXd Sharpness(const FlatMeasurement& m) {
  std::vector<double> sharpness;
  for (const Reading* reading : ReadingsOf(m))
    for (const double stddev : reading->stddev) sharpness.push_back(1.0 / stddev);
  return Eigen::Map<const Eigen::VectorXd>(sharpness.data(), static_cast<Eigen::Index>(sharpness.size()));
}

Eigen::VectorXd ValuesRead(const FlatMeasurement& m) {
  std::vector<double> values;
  for (const Reading* reading : ReadingsOf(m))
    values.insert(values.end(), reading->value.begin(), reading->value.end());
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace

FlatResiduals::FlatResiduals(const Capture& capture, const FreeParameters& free, int threads)
    : capture_(capture), free_(free), threads_(threads) {
  std::map<std::pair<std::string, size_t>, int> columns;  // key: sample and layer
  for (const FlatMeasurement& m : capture.measurements) {
    if (m.is_holdout) continue;
    auto group = std::find_if(groups_.begin(), groups_.end(),
                              [&](const Group& g) { return AreAlike(capture, g.members[0], m); });
    if (group == groups_.end()) group = groups_.emplace(groups_.end());
    group->first_row.push_back(rows_);
    group->members.push_back(m);
    rows_ += static_cast<int>(ValuesRead(m).size());
    for (size_t l = 0; m.thickness_stddev_mm > 0 && l < m.thickness_mm.size(); ++l) {
      FlatMeasurement thicker = m;
      thicker.thickness_mm[l] *= 1.0 + kStep;
      group->thicker.push_back(thicker);
      group->thicker_of.emplace_back(group->members.size() - 1, kStep * m.thickness_mm[l] / m.thickness_stddev_mm);
      const bool is_known = !m.sample.empty() && columns.contains({m.sample, l});
      group->column_of.push_back(is_known ? columns.at({m.sample, l}) : shared_++);
      if (!m.sample.empty()) columns[{m.sample, l}] = group->column_of.back();
    }
  }
}

void FlatResiduals::Evaluate(const Group& group, const Eigen::VectorXd& x, Evaluation& e,
                             Eigen::MatrixXd& shared) const {
  const Material here = MaterialAt(free_, x);
  std::vector<FlatMeasurement> all = group.members;
  all.insert(all.end(), group.thicker.begin(), group.thicker.end());
  Bands bands;
  for (int c = 0; c < capture_.channels(); ++c) bands.push_back(ReadBand(capture_, all, here, c));
  const auto rows = [&](auto&& column, size_t i, const Eigen::VectorXd& change) {
    column.segment(group.first_row[i], change.size()) = change.cwiseProduct(Sharpness(group.members[i]));
  };
  for (size_t i = 0; i < group.members.size(); ++i) {
    const FlatMeasurement& m = group.members[i];
    rows(e.residuals, i, Values(m, bands, i) - ValuesRead(m));
    if (!m.aperture_mm) continue;
    Bands lossier = bands;
    for (auto& band : lossier) band[i].reflectance -= kEdgeLossError * band[i].edge_loss;
    rows(shared.col(0), i, Values(m, lossier, i) - Values(m, bands, i));
  }
  for (size_t k = 0; k < group.thicker.size(); ++k) {
    const auto [i, stddevs] = group.thicker_of[k];
    rows(shared.col(group.column_of[k]), i,
         (Values(group.members[i], bands, group.members.size() + k) - Values(group.members[i], bands, i)) / stddevs);
  }
  if (e.jacobian.size() == 0) return;
  // Coefficients change by finite differences of the free parameters; readings by exact derivatives by coefficients.
  std::vector<MaterialStep> steps;
  Eigen::VectorXd width(free_.count());
  for (int p = 0; p < free_.count(); ++p) {
    Eigen::VectorXd up = x, down = x;
    up[p] = std::min(x[p] + kStep, free_.entries[p].high);
    down[p] = std::max(x[p] - kStep, free_.entries[p].low);
    width[p] = up[p] - down[p];
    steps.push_back({MaterialAt(free_, down), MaterialAt(free_, up)});
  }
  std::vector<std::vector<std::vector<BandReading>>> changes;
  for (int c = 0; c < capture_.channels(); ++c)
    changes.push_back(ReadBandChanges(capture_, group.members, here, c, steps));
  for (int p = 0; p < free_.count(); ++p)
    for (size_t i = 0; i < group.members.size(); ++i) {
      const auto moved = [&](double share) {
        std::vector<BandReading> there(bands.size());
        for (size_t c = 0; c < there.size(); ++c) {
          there[c] = bands[c][i];
          there[c].reflectance += share * changes[c][i][p].reflectance;
          there[c].transmittance += share * changes[c][i][p].transmittance;
        }
        return Values(group.members[i], there);
      };
      rows(e.jacobian.col(p), i, (moved(0.5) - moved(-0.5)) / width[p]);
    }
}

FlatResiduals::Evaluation FlatResiduals::Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const {
  Evaluation e;
  e.residuals.resize(rows_);
  if (with_jacobian) e.jacobian.setZero(rows_, free_.count());
  Eigen::MatrixXd shared = Eigen::MatrixXd::Zero(rows_, shared_);  // per standard deviation of each shared error
  ParallelFor(groups_.size(), threads_, [&](size_t g) { Evaluate(groups_[g], x, e, shared); });
  const Eigen::LLT<Eigen::MatrixXd> root(
      Eigen::MatrixXd(Eigen::MatrixXd::Identity(rows_, rows_) + shared * shared.transpose()));
  root.matrixL().solveInPlace(e.residuals);
  if (with_jacobian) root.matrixL().solveInPlace(e.jacobian);
  return e;
}

}  // namespace crownfit
