#include "fit/judge.h"

#include <algorithm>
#include <cmath>

#include "fit/contradictions.h"
#include "fit/gaussian_information.h"

namespace crownfit {
namespace {

constexpr double kLevelDrift = 0.08;  // of a photograph: twice the error of model `shader`
constexpr double kMostOfWalks = 0.8;  // share of a variance

/// Whether the finding explains a refusal, so that it belongs to the refusal's reasons.
bool ExplainsRefusal(const Finding& finding) {
  return finding.kind == FindingKind::kLightNotCalibrated || finding.kind == FindingKind::kColourNotCalibrated;
}

void AddLevels(const CrownFit& fit, std::vector<Finding>& findings) {
  for (const PhotographResult& p : fit.photographs)
    if (!p.is_holdout && !p.exposure_is_fitted &&
        std::abs(p.level - 1) > std::max(kLevelDrift, kLevelCertain * p.level_stddev))
      findings.push_back({FindingKind::kPhotographLevel, {p.level}, {p.name}});
  for (size_t i = 0; i < fit.photographs.size(); ++i) {
    const PhotographResult& p = fit.photographs[i];
    const double stated = fit.capture.photographs[i].exposure_stddev / p.exposure;
    if (p.is_holdout && p.level > 0 &&
        std::abs(p.level - 1) > std::max(kLevelDrift, kLevelCertain * std::hypot(p.level_stddev, stated)))
      findings.push_back({FindingKind::kHoldoutLevel, {p.level}, {p.name}});
  }
}

void AddOfWalks(const CrownFit& fit, std::vector<Finding>& findings) {
  if (fit.model == Model::kDiffusion)
    findings.push_back({FindingKind::kSwitchesToDiffusion, {static_cast<double>(fit.options.collisions)}});
  for (const int k : HeldByWalks(fit.capture, fit.entries))
    findings.push_back({FindingKind::kNotMovedByWalks, {}, {fit.entries[k].name}});
  for (const double rival : fit.rival_roughness) findings.push_back({FindingKind::kRivalRoughness, {rival}});
  Finding noisy{FindingKind::kNoisyIntervals, {static_cast<double>(fit.options.paths_per_photograph)}};
  const std::vector<double>& of_walks = fit.uncertainty.of_walks;
  for (size_t k = 0; k < of_walks.size(); ++k)
    if (of_walks[k] > kMostOfWalks) noisy.names.push_back(fit.entries[k].name);
  if (!noisy.names.empty()) findings.push_back(std::move(noisy));
}

}  // namespace

const char* SourceOf(const CrownFit& fit) {
  return fit.photographs.empty() ? "measurements"
         : fit.readings.empty()  ? "photographs"
                                 : "photographs and measurements";
}

std::vector<std::string> NamesOfStatus(const CrownFit& fit, Status status) {
  std::vector<std::string> names;
  for (const auto& p : fit.uncertainty.parameters) {
    const std::vector<size_t> channels = p.ChannelsThatAre(status);
    if (channels.size() == p.value.size())
      names.push_back(p.name);
    else
      for (const size_t c : channels) names.push_back(p.name + "[" + fit.capture.channel_names[c] + "]");
  }
  return names;
}

std::vector<Finding> ModelFindings(const CrownFit& fit) {
  std::vector<Finding> findings;
  for (const MovedCalibration& moved : fit.calibration)
    if (!IsInflated(fit, moved.kind) && moved.Stddevs() > kFarMoved &&
        (moved.share == 0 || fit.is_by_walks() || std::abs(moved.share) > kLevelDrift))
      findings.push_back({FindingKind::kCalibrationMoved, {moved.Stddevs()}, {moved.what}});
  for (const CalibrationKind kind : kCalibrationKinds)
    if (IsInflated(fit, kind))
      findings.push_back(
          FurthestOff(fit, kind, FindingKind::kErrorsInflated, fit.inflation[static_cast<size_t>(kind)]));
  AddLevels(fit, findings);
  for (const Finding& finding :
       {PhotographsNotExplained(fit.photographs), SceneryThatIsOff(fit.scenery), PriorsContradicted(fit)})
    if (!finding.names.empty()) findings.push_back(finding);
  if (fit.ends_at_neck) findings.push_back({FindingKind::kOpenNeck, {kNeckReachMm}});
  if (fit.is_by_walks()) {
    AddOfWalks(fit, findings);
  } else if (fit.model == Model::kLayered) {
    findings.push_back({FindingKind::kLayeredAssumptions});
    if (fit.uncertainty.freedom <= 1.0) findings.push_back({FindingKind::kFewReadings});
  } else {
    findings.push_back({FindingKind::kShaderAssumptions});
    if (!fit.readings.empty()) findings.push_back({FindingKind::kMeasurementsOutweighed});
    for (size_t l = 2; l < fit.capture.layers.size(); ++l)
      findings.push_back({FindingKind::kLayerNotSeen, {}, {fit.capture.layers[l].name}});
  }
  return findings;
}

void Judge(CrownFit& fit, std::vector<Finding> refusals) {
  fit.reasons = std::move(refusals);
  const Uncertainty& u = fit.uncertainty;
  const char* source = SourceOf(fit);
  if (!fit.converged) fit.reasons.push_back({FindingKind::kNotConverged});
  // With few readings a larger value is not rare.
  const double limit =
      u.freedom > 0 ? std::max(kChi2Limit, UnlikelyChi2(static_cast<int>(u.freedom)) / u.freedom) : kChi2Limit;
  if (u.reduced_chi2 > limit) fit.reasons.push_back({FindingKind::kChi2, {u.reduced_chi2, limit}, {source}});
  if (fit.is_by_walks() && u.block_chi2 > kChi2Limit)
    fit.reasons.push_back({FindingKind::kPatchChi2, {u.block_chi2, kChi2Limit}});
  if (fit.residual_chi2.regions.IsMoreThan(kChi2Limit))
    fit.reasons.push_back({FindingKind::kRegionChi2, {fit.residual_chi2.regions.chi2, kChi2Limit}});
  for (const CalibrationKind kind : kCalibrationKinds)
    if (fit.inflation[static_cast<size_t>(kind)] >= kMostInflated)
      fit.reasons.push_back(FurthestOff(fit, kind, FindingKind::kStatementContradicted, kMostInflated));
  if (std::vector<std::string> names = LightsThatSceneryDenies(fit.scenery); !names.empty()) {
    const Finding off = SceneryThatIsOff(fit.scenery);
    Finding lamps{FindingKind::kLampsContradictScenery, {static_cast<double>(names.size())}, std::move(names)};
    lamps.numbers.insert(lamps.numbers.end(), off.numbers.begin(), off.numbers.end());
    lamps.names.insert(lamps.names.end(), off.names.begin(), off.names.end());
    fit.reasons.push_back(std::move(lamps));
  }
  for (Finding& denied : LawsDenied(fit, source)) fit.reasons.push_back(std::move(denied));
  const auto any_is = [&](std::initializer_list<Status> which) {
    return std::any_of(u.parameters.begin(), u.parameters.end(), [&](const FittedParameter& p) {
      return std::any_of(which.begin(), which.end(), [&](Status s) { return !p.ChannelsThatAre(s).empty(); }) &&
             p.quantity != Quantity::kRoughness && p.quantity != Quantity::kWetness;
    });
  };
  if (!any_is({Status::kFitted})) {
    Finding nothing{FindingKind::kNothingFitted, {}, {source}};
    if (u.reduced_chi2 <= limit && !fit.options.prior.empty() && any_is({Status::kPrior}) &&
        !any_is({Status::kNotIdentified, Status::kAtBound}))
      nothing.names.push_back(fit.options.prior.string());
    fit.reasons.push_back(std::move(nothing));
  }
  fit.usable = fit.reasons.empty();
  if (std::vector<std::string> names = NamesOfStatus(fit, Status::kAtBound); !names.empty())
    fit.reasons.push_back({FindingKind::kAtBound, {}, std::move(names)});
  if (!fit.usable)
    std::copy_if(fit.caveats.begin(), fit.caveats.end(), std::back_inserter(fit.reasons), ExplainsRefusal);
}

}  // namespace crownfit
