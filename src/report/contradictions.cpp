#include "report/contradictions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"

namespace crownfit {
namespace {

constexpr double kSceneryOff = 0.05;   // of tiles and scenery beside the object, whose reflectance is stated
constexpr double kNotExplained = 1.5;  // of the square of noise, in patches of a photograph

/// 1 and -1: brighter and darker than stated, beyond doubt; 0: as stated.
int IsOff(const SceneryLevel& level, int channel) {
  const double off = level.ratio[channel] - 1;
  const double limit = std::max(kSceneryOff, kLevelCertain * std::hypot(level.stddev[channel], level.stated));
  return std::abs(off) <= limit ? 0 : off > 0 ? 1 : -1;
}

std::string InWords(const std::array<double, kChannels>& ratio) {
  std::string words;
  for (int c = 0; c < kChannels; ++c) words += (c ? ", " : "") + Number(ratio[c]);
  return words;
}

/// Whether things of several reflectances are off by the same factor, so that it is no reflectance that is stated
/// wrongly but the light (dark ones whose reflectance was guessed, or under a veil, are not).
bool DenyTheirLight(const std::vector<const SceneryLevel*>& levels) {
  std::set<std::vector<std::string>> kinds;
  std::array<double, kChannels> mean{};
  for (const SceneryLevel* level : levels) {
    kinds.insert(level->shows);
    for (int c = 0; c < kChannels; ++c) mean[c] += level->ratio[c] / static_cast<double>(levels.size());
  }
  if (kinds.size() < 2) return false;
  for (int c = 0; c < kChannels; ++c)
    if (std::all_of(levels.begin(), levels.end(), [&](const SceneryLevel* l) {
          return IsOff(*l, c) != 0 && std::abs(l->ratio[c] / mean[c] - 1) < kSceneryOff;
        }))
      return true;
  return false;
}

}  // namespace

const char* NameOf(StatementKind kind) {
  switch (kind) {
    case StatementKind::kExposure:
      return "exposures";
    case StatementKind::kIntensity:
      return "intensities of lamps";
    case StatementKind::kPose:
      return "poses";
    case StatementKind::kPlace:
      return "places of lamps";
  }
  return "";
}

bool IsWidened(const CrownFit& fit, StatementKind kind) { return fit.widened[static_cast<size_t>(kind)] > 1; }

std::string FurthestOff(const CrownFit& fit, StatementKind kind) {
  const MovedCalibration* furthest = nullptr;
  for (const MovedCalibration& m : fit.calibration)
    if (m.kind == kind && (!furthest || m.chi2 / m.freedom > furthest->chi2 / furthest->freedom)) furthest = &m;
  if (!furthest) return "";
  const std::string errors = Number(furthest->Stddevs()) + " times its stated error";
  if (furthest->share == 0) return furthest->what + " is off by " + errors;
  return furthest->what + " is " + Number(100 * std::abs(furthest->share)) + " % " +
         (furthest->share > 0 ? "more" : "less") + " than stated, which is " + errors;
}

std::string SceneryThatIsOff(const std::vector<SceneryLevel>& levels) {
  std::string off;
  for (const SceneryLevel& level : levels) {
    bool is_off = false;
    for (int c = 0; c < kChannels; ++c) is_off |= IsOff(level, c) != 0;
    if (is_off) off += (off.empty() ? "" : "; ") + ("'" + level.photograph + "' " + InWords(level.ratio) + " times");
  }
  return off;
}

std::string LightsThatSceneryDenies(const std::vector<SceneryLevel>& levels) {
  std::map<std::string, std::vector<const SceneryLevel*>> by_light;
  for (const SceneryLevel& level : levels)
    for (const std::string& light : level.lights) by_light[light].push_back(&level);
  std::string names;
  for (const auto& [light, lit] : by_light)
    if (DenyTheirLight(lit)) names += (names.empty() ? "'" : ", '") + light + "'";
  return names;
}

std::string PhotographsNotExplained(const std::vector<PhotographResult>& photographs) {
  std::string names;
  for (const PhotographResult& p : photographs) {
    std::string parts;
    if (p.left && p.left->patches.IsMoreThan(kNotExplained)) parts = "patches " + Number(p.left->patches.chi2);
    if (p.left && p.left->regions.IsMoreThan(kNotExplained))
      parts += (parts.empty() ? "sixteenths " : ", sixteenths ") + Number(p.left->regions.chi2);
    if (!parts.empty()) names += (names.empty() ? "'" : ", '") + p.name + "' (" + parts + ")";
  }
  return names;
}

std::string LawsDenied(const CrownFit& fit) {
  std::string denied;
  const auto& wavelengths = fit.capture.wavelengths_nm;
  const bool have_slope = std::ranges::count(wavelengths, wavelengths[0]) < static_cast<long>(kChannels);
  for (const LawDeparture& d : fit.departures) {
    const auto p = std::ranges::find(fit.uncertainty.parameters, d.parameter, &FittedParameter::name);
    if (p == fit.uncertainty.parameters.end() || d.chi2 < UnlikelyChi2(d.freedom)) continue;
    bool beyond = false;
    std::string percent;
    for (size_t c = 0; c < kChannels; ++c) {
      const size_t of = std::min(c, p->value.size() - 1);
      const double there = p->value[of] * std::exp(d.moved[c]);
      beyond |= there < p->low95[of] || there > p->high95[of];
      percent += (c ? ", " : "") + Number(100 * std::expm1(d.moved[c]), 2);
    }
    if (!beyond) continue;
    const bool is_one = d.law == Sharing::kOneValue;
    denied += (denied.empty() ? "'" : "; '") + d.parameter + "' is " +
              (is_one ? "not one value in all channels" : "no power law over the channels") +
              ", as stated: left free they would be " + percent +
              " % off it, which its interval does not hold (--share " + d.parameter + "=" +
              Word(is_one && have_slope ? Sharing::kPowerLaw : Sharing::kNone) + ")";
  }
  return denied;
}

std::string PriorsContradicted(const CrownFit& fit) {
  const DataKnowledge& k = fit.knowledge;
  std::string names;
  for (Eigen::Index i = 0; fit.options.use_priors && i < k.by_photographs.size(); ++i) {
    const FreeEntry& e = fit.entries[static_cast<size_t>(i)];
    const double variance = k.Variance(Eigen::RowVectorXd::Unit(k.by_photographs.size(), i));
    const double off = std::abs(k.by_photographs[i] - e.prior_mean) / std::hypot(std::sqrt(variance), e.prior_stddev);
    if (off > kFarMoved) names += (names.empty() ? "'" : ", '") + e.name + "' (" + Number(off) + ")";
  }
  return names;
}

}  // namespace crownfit
