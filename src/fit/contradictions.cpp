#include "fit/contradictions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "capture/capture.h"

namespace crownfit {
namespace {

constexpr double kSceneryOff = 0.05;   // relative; of tiles and scenery beside the object, whose reflectance is stated
constexpr double kNotExplained = 1.5;  // times the squared noise, in patches of a photograph

/// 1 and -1: certainly brighter and darker than stated; 0: as stated.
int IsOff(const SceneryLevel& level, int channel) {
  const double off = level.ratio[channel] - 1;
  const double limit = std::max(kSceneryOff, kLevelCertain * std::hypot(level.stddev[channel], level.stated));
  return std::abs(off) <= limit ? 0 : off > 0 ? 1 : -1;
}

/// Whether objects of several reflectances are off by the same factor. Then the light is wrong, and not a stated
/// reflectance. (Dark objects, whose reflectance was guessed or which a veil brightens, are not off by the same
/// factor.)
bool DenyTheirLight(const std::vector<const SceneryLevel*>& levels) {
  std::set<std::vector<std::string>> kinds;
  Spectrum mean;
  for (const SceneryLevel* level : levels) {
    kinds.insert(level->shows);
    mean += level->ratio / static_cast<double>(levels.size());
  }
  if (kinds.size() < 2) return false;
  for (int c = 0; c < mean.size(); ++c)
    if (std::all_of(levels.begin(), levels.end(), [&](const SceneryLevel* l) {
          return IsOff(*l, c) != 0 && std::abs(l->ratio[c] / std::as_const(mean)[c] - 1) < kSceneryOff;
        }))
      return true;
  return false;
}

}  // namespace

bool IsInflated(const CrownFit& fit, CalibrationKind kind) { return fit.inflation[static_cast<size_t>(kind)] > 1; }

Finding FurthestOff(const CrownFit& fit, CalibrationKind kind, FindingKind as, double factor) {
  const MovedCalibration* furthest = nullptr;
  for (const MovedCalibration& m : fit.calibration)
    if (m.kind == kind && (!furthest || m.chi2 / m.freedom > furthest->chi2 / furthest->freedom)) furthest = &m;
  Finding finding{as, {static_cast<double>(kind), factor}};
  if (furthest) {
    finding.numbers.insert(finding.numbers.end(), {furthest->Stddevs(), furthest->share});
    finding.names = {furthest->what};
  }
  return finding;
}

Finding SceneryThatIsOff(const std::vector<SceneryLevel>& levels) {
  Finding off{FindingKind::kSceneryOff};
  for (const SceneryLevel& level : levels) {
    bool is_off = false;
    for (int c = 0; c < level.ratio.size(); ++c) is_off |= IsOff(level, c) != 0;
    if (!is_off) continue;
    off.names.push_back(level.photograph);
    off.numbers.insert(off.numbers.end(), level.ratio.begin(), level.ratio.end());
  }
  return off;
}

std::vector<std::string> LightsThatSceneryDenies(const std::vector<SceneryLevel>& levels) {
  std::map<std::string, std::vector<const SceneryLevel*>> by_light;
  for (const SceneryLevel& level : levels)
    for (const std::string& light : level.lights) by_light[light].push_back(&level);
  std::vector<std::string> names;
  for (const auto& [light, lit] : by_light)
    if (DenyTheirLight(lit)) names.push_back(light);
  return names;
}

Finding PhotographsNotExplained(const std::vector<PhotographResult>& photographs) {
  Finding finding{FindingKind::kPhotographsNotExplained};
  const auto beyond = [](const auto& chi2) { return chi2.IsMoreThan(kNotExplained) ? chi2.chi2 : 0.0; };
  for (const PhotographResult& p : photographs) {
    const double patches = p.residual_chi2 ? beyond(p.residual_chi2->patches) : 0,
                 regions = p.residual_chi2 ? beyond(p.residual_chi2->regions) : 0;
    if (patches == 0 && regions == 0) continue;
    finding.names.push_back(p.name);
    finding.numbers.insert(finding.numbers.end(), {patches, regions});
  }
  return finding;
}

std::vector<Finding> LawsDenied(const CrownFit& fit, const char* source) {
  std::vector<Finding> denied;
  const bool have_slope = !HaveOneWavelength(fit.capture.wavelengths_nm);
  for (const LawDeparture& d : fit.departures) {
    const auto p = std::ranges::find(fit.uncertainty.parameters, d.parameter, &FittedParameter::name);
    if (p == fit.uncertainty.parameters.end() || d.chi2 < UnlikelyChi2(d.freedom)) continue;
    const bool is_one = d.law == Sharing::kOneValue;
    Finding finding{FindingKind::kSharingRejected, {is_one ? 1.0 : 0.0}};
    bool beyond = false;
    for (int c = 0; c < d.moved.size(); ++c) {
      const size_t of = std::min(static_cast<size_t>(c), p->value.size() - 1);
      const double there = p->value[of] * std::exp(d.moved[c]);
      beyond |= there < p->low95[of] || there > p->high95[of];
      finding.numbers.push_back(100 * std::expm1(d.moved[c]));
    }
    finding.names = {d.parameter, Word(is_one && have_slope ? Sharing::kPowerLaw : Sharing::kNone), source};
    if (beyond) denied.push_back(std::move(finding));
  }
  return denied;
}

Finding PriorsContradicted(const CrownFit& fit) {
  const DataEstimate& k = fit.knowledge;
  Finding finding{FindingKind::kPriorsContradicted};
  for (Eigen::Index i = 0; fit.options.use_priors && i < k.by_photographs.size(); ++i) {
    const FreeEntry& e = fit.entries[static_cast<size_t>(i)];
    const double variance = k.Variance(Eigen::RowVectorXd::Unit(k.by_photographs.size(), i));
    const double off = std::abs(k.by_photographs[i] - e.prior_mean) / std::hypot(std::sqrt(variance), e.prior_stddev);
    if (off <= kFarMoved) continue;
    finding.names.push_back(e.name);
    finding.numbers.push_back(off);
  }
  return finding;
}

}  // namespace crownfit
