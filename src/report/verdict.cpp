#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "fit/entry_knowledge.h"
#include "report/contradictions.h"

namespace crownfit {
namespace {

constexpr double kLevelDrift = 0.08;  // of a photograph: twice what model `shader` is off by
constexpr double kMostOfWalks = 0.8;  // of a variance

std::string Names(const CrownFit& fit, Status status) {
  std::string names;
  for (const auto& p : fit.uncertainty.parameters) {
    const std::vector<size_t> channels = p.ChannelsThatAre(status);
    if (channels.size() == p.value.size()) {
      names += (names.empty() ? "" : ", ") + p.name;
    } else {
      for (const size_t c : channels)
        names += (names.empty() ? "" : ", ") + p.name + "[" + fit.capture.channel_names[c] + "]";
    }
  }
  return names;
}

/// Of the object, what the capture fixes and photographs hardly show to be wrong. Beside photographs the innermost
/// layer's depth, and one that ends at a mesh, is the scan's.
std::string CountedAsExact(const CrownFit& fit) {
  const std::vector<LayerSpec>& layers = fit.capture.layers;
  const bool has_scan = !fit.photographs.empty();
  std::string names = has_scan ? "the scan" : "";
  for (const FittedParameter& p : fit.uncertainty.parameters) {
    const bool is_scans = has_scan && (p.layer + 1 >= layers.size() || layers[p.layer + 1].surface);
    if (p.status == Status::kFixed &&
        (p.quantity == Quantity::kIor || p.quantity == Quantity::kAsymmetry || p.quantity == Quantity::kRoughness ||
         (p.quantity == Quantity::kThickness && !is_scans)))
      names += (names.empty() ? "" : ", ") + p.name;
  }
  return names;
}

/// What speaks in this fit.
std::string SourceOf(const CrownFit& fit) {
  return fit.photographs.empty() ? "measurements"
         : fit.readings.empty()  ? "photographs"
                                 : "photographs and measurements";
}

}  // namespace

std::vector<std::string> ModelCaveats(const CrownFit& fit) {
  const Capture& capture = fit.capture;
  std::vector<std::string> caveats;
  for (const MovedCalibration& moved : fit.calibration)
    if (!IsWidened(fit, moved.kind) && moved.Stddevs() > kFarMoved &&
        (moved.share == 0 || fit.is_by_walks() || std::abs(moved.share) > kLevelDrift))
      caveats.push_back("The photographs disagree with " + moved.what + ": the fit moved it by " +
                        Number(moved.Stddevs()) +
                        " times its stated error. Calibrate it again; a lamp or the crown may have been moved.");
  for (const StatementKind kind : kStatementKinds)
    if (IsWidened(fit, kind))
      caveats.push_back("The photographs contradict the stated " + std::string(NameOf(kind)) + ": " +
                        FurthestOff(fit, kind) + ". Errors of all " + NameOf(kind) + " were taken to be " +
                        Number(fit.widened[static_cast<size_t>(kind)]) +
                        " times as large as stated. Measure again what is off, or state how well it is known.");
  for (const PhotographResult& p : fit.photographs)
    if (!p.is_holdout && !p.exposure_is_fitted &&
        std::abs(p.level - 1) > std::max(kLevelDrift, kLevelCertain * p.level_stddev))
      caveats.push_back("'" + p.name + "' is " + Number(100 * std::abs(p.level - 1)) + " % " +
                        (p.level > 1 ? "brighter" : "darker") +
                        " than the fit of all photographs predicts: did flash or exposure drift? State how well its "
                        "exposure_scale is known (\"stddev\"), or free it.");
  for (size_t i = 0; i < fit.photographs.size(); ++i) {
    const PhotographResult& p = fit.photographs[i];
    const double stated = capture.photographs[i].exposure_stddev / p.exposure;
    if (p.is_holdout && p.level > 0 &&
        std::abs(p.level - 1) > std::max(kLevelDrift, kLevelCertain * std::hypot(p.level_stddev, stated)))
      caveats.push_back("'" + p.name + "', which was held out, is " + Number(100 * std::abs(p.level - 1)) + " % " +
                        (p.level > 1 ? "brighter" : "darker") +
                        " than the fit predicts: its exposure or a lamp that only it has is stated wrongly, or fitted "
                        "values are wrong where the other photographs do not tell.");
  }
  if (const std::string names = PhotographsNotExplained(fit.photographs); !names.empty())
    caveats.push_back(
        "Patches of neighbouring pixels, or sixteenths of the picture, are further off than noise explains (squares "
        "over those of noise) in " +
        names +
        ". What the capture states of such a photograph may be wrong (pose, mask, lamps, scenery, "
        "polarisation, encoding), or of the object (surfaces, thickness, index); the report's maps of "
        "differences show where.");
  if (const std::string levels = SceneryThatIsOff(fit.scenery); !levels.empty())
    caveats.push_back(
        "Beside the object, tile or scenery are not as bright as lamps, exposure and reflectance make "
        "them: " +
        levels +
        " (red, green, blue). If they are what is seen there, one of these is stated wrongly, and the "
        "material made up for it; a mask leaves out what is not in the capture.");
  if (const std::string names = PriorsContradicted(fit); !names.empty())
    caveats.push_back(
        "The photographs contradict priors (by how many standard deviations): " + names +
        ". Either what the prior says is not so here, or something else in the capture is stated wrongly; "
        "intervals reach to where the photographs alone would put these.");
  if (fit.ends_at_neck)
    caveats.push_back("The scan is open at the neck: what lies beyond is assumed, and pixels within " +
                      Number(kNeckReachMm) + " mm of it count for less (up to 30 % error at the cut).");
  if (fit.is_by_walks()) {
    if (fit.model == "diffusion")
      caveats.push_back(
          "Model `diffusion` hands walks over to diffusion after " + std::to_string(fit.options.collisions) +
          " collisions. Intervals hold what it is wrong by as a rule, and one step that walks to their end would make "
          "from here; model path goes on with those.");
    for (const int k : HeldByWalks(capture, fit.entries))
      caveats.push_back("'" + fit.entries[k].name +
                        "' was not moved by walks, which give no derivative by it, and what it leaves open is not in "
                        "the other intervals. Fix it if you know it.");
    for (const double rival : fit.rival_roughness)
      caveats.push_back("A roughness of " + Number(rival) +
                        " explains the photographs as well as the one found. Intervals are wide enough for both; a "
                        "photograph with a highlight, or a known roughness, would tell.");
    std::string noisy;
    const std::vector<double>& of_walks = fit.uncertainty.of_walks;
    for (size_t k = 0; k < of_walks.size(); ++k)
      if (of_walks[k] > kMostOfWalks) noisy += (noisy.empty() ? "" : ", ") + fit.entries[k].name;
    if (!noisy.empty())
      caveats.push_back("The walks' noise makes most of the interval of " + noisy + ". More walks than " +
                        std::to_string(fit.options.paths_per_photograph) +
                        " (--walks) narrow it, unless the photographs hide it.");
    return caveats;
  }
  if (fit.model == "layered") {
    caveats.push_back(
        "Model `layered` takes the samples as flat, smooth and wide. Index, g and whatever else is fixed count as "
        "exact; in thin or clear samples g matters most.");
    if (fit.uncertainty.freedom <= 1.0)
      caveats.push_back("There are hardly more readings than numbers fitted: nothing tests whether the model holds.");
    return caveats;
  }
  caveats.push_back(
      "Model `shader` takes the layers below every point as flat. The intervals carry its mean error on path-traced "
      "objects (4 % of a photograph's level, 3 % of a patch); behind clear enamel without dentine and in light from "
      "behind it is off by more.");
  if (!fit.readings.empty())
    caveats.push_back(
        "Beside model `shader` measurements hardly count: thousands of pixels outweigh them. Fit the measurements "
        "alone "
        "and give that result as --prior.");
  for (size_t l = 2; l < capture.layers.size(); ++l)
    caveats.push_back("Layer '" + capture.layers[l].name + "' is not seen by model `shader`.");
  return caveats;
}

void Judge(CrownFit& fit, std::vector<std::string> reasons) {
  fit.reasons = std::move(reasons);
  const Uncertainty& u = fit.uncertainty;
  if (!fit.converged) fit.reasons.push_back("the optimiser did not converge");
  // Of few readings a larger one is no rarity.
  const double limit =
      u.freedom > 0 ? std::max(kChi2Limit, UnlikelyChi2(static_cast<int>(u.freedom)) / u.freedom) : kChi2Limit;
  if (u.reduced_chi2 > limit)
    fit.reasons.push_back("reduced chi2 is " + Number(u.reduced_chi2) + ", above the limit " + Number(limit) +
                          ": the model does not explain these " + SourceOf(fit) + " within their errors");
  if (fit.is_by_walks() && u.block_chi2 > kChi2Limit)
    fit.reasons.push_back("what is left in patches of neighbouring pixels is " + Number(u.block_chi2) +
                          " times the square of its noise (limit " + Number(kChi2Limit) +
                          "): the photographs, their calibration and the model contradict each other, or more walks "
                          "are needed (--walks)");
  if (fit.left.regions.IsMoreThan(kChi2Limit))
    fit.reasons.push_back("what is left in sixteenths of the photographs is " + Number(fit.left.regions.chi2) +
                          " times the square of its noise (limit " + Number(kChi2Limit) +
                          "), which hides in that of smaller patches: the photographs, their calibration and the model "
                          "contradict each other");
  for (const StatementKind kind : kStatementKinds)
    if (fit.widened[static_cast<size_t>(kind)] >= kMostWidened)
      fit.reasons.push_back("the stated " + std::string(NameOf(kind)) + " are contradicted by the photographs, even " +
                            "were their errors " + Number(kMostWidened) +
                            " times as large as stated: one of these is wrong, or the model does not hold (" +
                            FurthestOff(fit, kind) + ")");
  if (const std::string lights = LightsThatSceneryDenies(fit.scenery); !lights.empty())
    fit.reasons.push_back("in every photograph by " + lights +
                          " that shows tile or scenery these are brighter or darker than stated by the same factor, "
                          "whatever they are made of (" +
                          SceneryThatIsOff(fit.scenery) +
                          "): lamps, exposures or encoding are stated wrongly, and absorption follows such an error "
                          "many times over");
  if (const std::string laws = LawsDenied(fit); !laws.empty())
    fit.reasons.push_back("the " + SourceOf(fit) +
                          " deny what channels were to share, or their colours are wrong: " + laws);
  const auto any_is = [&](std::initializer_list<Status> which) {
    return std::any_of(u.parameters.begin(), u.parameters.end(), [&](const FittedParameter& p) {
      return std::any_of(which.begin(), which.end(), [&](Status s) { return !p.ChannelsThatAre(s).empty(); }) &&
             p.quantity != Quantity::kRoughness && p.quantity != Quantity::kWetness;
    });
  };
  const bool any = any_is({Status::kFitted});
  if (!any) {
    const bool file_says_it = u.reduced_chi2 <= limit && !fit.options.prior.empty() && any_is({Status::kPrior}) &&
                              !any_is({Status::kNotIdentified, Status::kAtBound});
    fit.reasons.push_back("nothing physical was fitted: no scattering, absorption, thickness or index is identified" +
                          (file_says_it ? "; these " + SourceOf(fit) + " add nothing to " + fit.options.prior.string() +
                                              ", which stands by itself"
                                        : std::string()));
  }
  fit.usable = fit.reasons.empty();
  const bool model_holds = !any && fit.reasons.size() == 1;
  if (const std::string at_bound = Names(fit, Status::kAtBound); !at_bound.empty())
    fit.reasons.push_back("at a bound: " + at_bound);
  if (!fit.usable) {
    // The circumstances that explain a refusal belong to its reasons.
    for (const auto& caveat : fit.caveats)
      if (caveat.find("not calibrated") != std::string::npos) fit.reasons.push_back(caveat);
  }

  const auto part = [&](Status status, const std::string& words) {
    const std::string names = Names(fit, status);
    return names.empty() ? "" : words + names + ". ";
  };
  fit.verdict = part(Status::kFitted, "The " + SourceOf(fit) + " identify ") +
                part(Status::kPrior, "Held by its prior, not measured: ") +
                part(Status::kNotIdentified, "Not identified by these " + SourceOf(fit) + ": ") +
                part(Status::kAtBound, "At a bound: ");
  if (const std::string names = CountedAsExact(fit); any && !names.empty())
    fit.verdict += "Counted as exact, as stated, with no share in the intervals: " + names + ". ";
  if (fit.verdict.empty()) fit.verdict = "Nothing was free to fit. ";
  fit.verdict.pop_back();
  if (!fit.usable)
    fit.verdict = "Not usable, see the reasons. " +
                  (model_holds ? fit.verdict : "Within the model, which does not hold here: " + fit.verdict);
}

}  // namespace crownfit
