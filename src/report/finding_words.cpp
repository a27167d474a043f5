#include "report/finding_words.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "fit/judge.h"
#include "photo/colour.h"

namespace crownfit {
namespace {

/// "'a', 'b'", from the `first` on.
std::string Quoted(const std::vector<std::string>& names, size_t first = 0) {
  std::string list;
  for (size_t i = first; i < names.size(); ++i) list += (i == first ? "'" : ", '") + names[i] + "'";
  return list;
}

const char* NameOf(CalibrationKind kind) {
  switch (kind) {
    case CalibrationKind::kExposure:
      return "exposures";
    case CalibrationKind::kIntensity:
      return "lamp intensities";
    case CalibrationKind::kPose:
      return "poses";
    case CalibrationKind::kPlace:
      return "lamp positions";
  }
  return "";
}

/// "10 % brighter"
std::string Brighter(double level) {
  return Number(100 * std::abs(level - 1)) + (level > 1 ? " % brighter" : " % darker");
}

/// "the exposure of 'front' is 10 % less than stated, which is 9.8 times its stated error": of kErrorsInflated and
/// kStatementContradicted.
std::string FurthestOff(const Finding& f) {
  if (f.names.empty()) return "";
  const std::string errors = Number(f.numbers[2]) + " times its stated error";
  const double share = f.numbers[3];
  if (share == 0) return f.names[0] + " is off by " + errors;
  return f.names[0] + " is " + Number(100 * std::abs(share)) + " % " + (share > 0 ? "more" : "less") +
         " than stated, which is " + errors;
}

/// "'front' 0.92, 0.92, 0.91; 'back' ...", of the photographs from the `first` name on.
std::string LevelsOfScenery(const Finding& f, size_t first_name, size_t first_number) {
  const size_t channels = (f.numbers.size() - first_number) / std::max<size_t>(1, f.names.size() - first_name);
  std::string words;
  for (size_t i = first_name, n = first_number; i < f.names.size(); ++i) {
    words += (words.empty() ? "'" : "; '") + f.names[i] + "' ";
    for (size_t c = 0; c < channels; ++c) words += (c ? ", " : "") + Number(f.numbers[n++]);
  }
  return words;
}

std::string NotExplained(const Finding& f) {
  std::string words;
  for (size_t i = 0; i < f.names.size(); ++i) {
    const double patches = f.numbers[2 * i], regions = f.numbers[2 * i + 1];
    words += (i ? ", '" : "'") + f.names[i] + "' (" + (patches > 0 ? "patches " + Number(patches) : "") +
             (patches > 0 && regions > 0 ? ", " : "") + (regions > 0 ? "image regions " + Number(regions) : "") + ")";
  }
  return words;
}

std::string WithNumbers(const Finding& f) {
  std::string words;
  for (size_t i = 0; i < f.names.size(); ++i)
    words += (i ? ", '" : "'") + f.names[i] + "' (" + Number(f.numbers[i]) + ")";
  return words;
}

std::string SharingRejected(const Finding& f) {
  std::string percent;
  for (size_t i = 1; i < f.numbers.size(); ++i) percent += (i > 1 ? ", " : "") + Number(f.numbers[i], 2);
  const bool is_one = f.numbers[0] != 0;
  return "The " + f.names[2] + " reject " +
         (is_one ? "the one value that all channels share of '" : "the power law that the channels share of '") +
         f.names[0] + "', or the colour calibration is wrong. Fitted in each channel, it departs from that by " +
         percent + " %, which its interval does not cover. Try --share " + f.names[0] + "=" + f.names[1] + ".";
}

/// What counts as exact of the object: the capture fixes it, and photographs hardly show it to be wrong. With
/// photographs the scan gives the innermost layer's depth, and that of a layer that ends at a mesh.
std::vector<std::string> CountedAsExact(const CrownFit& fit) {
  const std::vector<LayerSpec>& layers = fit.capture.layers;
  const bool has_scan = !fit.photographs.empty();
  std::vector<std::string> names;
  if (has_scan) names.push_back("the scan");
  for (const FittedParameter& p : fit.uncertainty.parameters) {
    const bool is_scans = has_scan && (p.layer + 1 >= layers.size() || layers[p.layer + 1].surface);
    if (p.status == Status::kFixed &&
        (p.quantity == Quantity::kIor || p.quantity == Quantity::kAsymmetry || p.quantity == Quantity::kRoughness ||
         (p.quantity == Quantity::kThickness && !is_scans)))
      names.push_back(p.name);
  }
  return names;
}

std::string Joined(const std::vector<std::string>& names) {
  std::string list;
  for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
  return list;
}

}  // namespace

std::string Listed(const std::vector<std::string>& names) {
  std::string list;
  for (size_t i = 0; i < names.size(); ++i) list += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + names[i];
  return list;
}

std::string InWords(const Finding& f) {
  const std::vector<double>& n = f.numbers;
  switch (f.kind) {
    case FindingKind::kWhiteBalanceDiffers:
      return "The white balance differs between the camera files of " + Quoted(f.names) +
             ", so their red and blue are on different scales. Use one white balance for all photographs.";
    case FindingKind::kForeignPrimaries:
      return "Photograph '" + f.names[0] + "' has primaries other than sRGB's: " + f.names[1] +
             ". Its tone curve was decoded and its primaries were kept, so colours are off. Calibrate the colour from "
             "a "
             "chart that was exported in the same way, or export with an sRGB profile.";
    case FindingKind::kTransparentPixels:
      return Printed("%.0f pixels of photograph ", n[0]) + Quoted(f.names) +
             " have an alpha below 1. They are not used: what lies behind them is mixed into their light.";
    case FindingKind::kFalseColours:
      return "The channels are " + BandsText(n) +
             ", not red, green and blue in this order. Fitted values hold for the bands as stated; colours, CIEDE2000 "
             "and shades are those of a picture in false colours.";
    case FindingKind::kNoColour:
      return "The channels (" + BandsText(n) +
             ") have no colour: fewer than eight of them cover 400 to 700 nm, and there is no colour file. Pictures "
             "show "
             "their mean as grey, and CIEDE2000 is a difference of lightness alone.";
    case FindingKind::kLightNotCalibrated:
      return "The light was not calibrated: the photographs are encoded for display (8 bits, taken as sRGB; the "
             "camera's tone curve is unknown). Ratios between bright and dark can't be trusted, and absorption and "
             "thickness follow from them.";
    case FindingKind::kJpeg:
      return "Some photographs are JPEG files (" + Joined(f.names) +
             "). Compression and sharpening change values by several per cent over blocks of 8 pixels, and no noise "
             "model here contains that. Use the camera's RAW files.";
    case FindingKind::kColourNotCalibrated:
      return "The colour was not calibrated: there is no colour chart, and the white balance is unknown. Differences "
             "between the channels can't be trusted, and the colour of absorption and scattering follows from them.";
    case FindingKind::kEveryExposureFree:
      return "Every exposure is free, so absolute reflectance is not identified. Only the pattern over the crown and "
             "the ratios of the channels are used.";
    case FindingKind::kNoiseAssumed:
      return "There is no noise calibration. A relative noise of 1 % was assumed, and all intervals depend on it.";
    case FindingKind::kCalibrationMoved:
      return "The photographs disagree with " + f.names[0] + ": the fit moved it by " + Number(n[0]) +
             " times its stated error. Calibrate it again: a lamp or the crown may have moved.";
    case FindingKind::kErrorsInflated: {
      const std::string kind = NameOf(static_cast<CalibrationKind>(n[0]));
      return "The photographs contradict the stated " + kind + ": " + FurthestOff(f) + ". The errors of all " + kind +
             " were taken as " + Number(n[1]) +
             " times as large as stated. Measure again what is off, or state how well it is known.";
    }
    case FindingKind::kPhotographLevel:
      return "Photograph " + Quoted(f.names) + " is " + Brighter(n[0]) +
             " than the fit of all photographs predicts. The flash or the exposure may have drifted. State how well "
             "its exposure_scale is known (\"stddev\"), or free it.";
    case FindingKind::kHoldoutLevel:
      return "Photograph " + Quoted(f.names) + ", which was held out, is " + Brighter(n[0]) +
             " than the fit predicts. Its exposure or a lamp that only it has is stated wrongly, or fitted values are "
             "wrong where the other photographs do not determine them.";
    case FindingKind::kPhotographsNotExplained:
      return "In these photographs the residuals are larger than noise explains (squared residuals over those of "
             "noise): " +
             NotExplained(f) +
             ". Something may be stated wrongly for the photograph (pose, mask, lamps, scenery, polarisation, "
             "encoding) or for the object (surfaces, thickness, index). The difference maps of the report show where.";
    case FindingKind::kSceneryOff:
      return "The tile or scenery beside the object is not as bright as lamps, exposure and reflectance predict. It is "
             "brighter by these factors (red, green, blue): " +
             LevelsOfScenery(f, 0, 0) +
             ". One of these values may be stated wrongly, and the fitted material makes up for it. If something else "
             "is seen there, mask it.";
    case FindingKind::kPriorsContradicted:
      return "The photographs contradict these priors (in standard deviations): " + WithNumbers(f) +
             ". The prior is wrong for this material, or something else in the capture is stated wrongly. The "
             "intervals extend to the values that the photographs alone would give.";
    case FindingKind::kCapturesDisagree:
      return Printed(
          "Capture '%s' disagrees with the other captures (chi2 %.0f, expected %.0f), most of all in %s: %.3g by "
          "itself, %.3g by the others. Check that it shows the same material and that its calibration is right. The "
          "intervals do not cover this difference.",
          f.names[0].c_str(), n[0], n[1], f.names[1].c_str(), n[2], n[3]);
    case FindingKind::kOpenNeck:
      return "The scan is open at the neck. The shape beyond is assumed, so pixels within " + Number(n[0]) +
             " mm of the cut count less (the error may be 30 % at the cut).";
    case FindingKind::kPartLeftOut:
      if (n.empty()) return "Left out of the scene as you asked: " + f.names[0] + ".";
      return "Left out of the scene because it is not needed: " + f.names[0] + ". The picture changes by CIEDE2000 " +
             Number(n[0], 2) + ", and fitted values by at most " + Number(n[1], 2) + " standard deviations.";
    case FindingKind::kSwitchesToDiffusion:
      return "Model `diffusion` switches every walk to diffusion after " + Number(n[0], 9) +
             " collisions. The intervals include its mean error. Model `path` follows the walks to their end.";
    case FindingKind::kNotMovedByWalks:
      return "Random walks give no derivative with respect to " + Quoted(f.names) +
             ", so it was not fitted, and its uncertainty is not part of the other intervals. Fix it if you know it.";
    case FindingKind::kRivalRoughness:
      return "A roughness of " + Number(n[0]) +
             " explains the photographs as well as the fitted one. The intervals cover both. A photograph with a "
             "highlight, or a known roughness, would decide.";
    case FindingKind::kNoisyIntervals:
      return "Monte Carlo noise makes up most of the interval of " + Joined(f.names) + ". More than " +
             Number(n[0], 12) + " walks (--walks) may narrow it.";
    case FindingKind::kLayeredAssumptions:
      return "Model `layered` assumes that the samples are flat, smooth and wide. Index, g and all other fixed values "
             "count as exact. In thin or clear samples g matters most.";
    case FindingKind::kFewReadings:
      return "There are hardly more readings than fitted values, so nothing tests whether the model holds.";
    case FindingKind::kShaderAssumptions:
      return "Model `shader` takes the layers below every point as flat. The intervals include its mean error on "
             "path-traced objects (4 % of a photograph's level, 3 % of a patch). Its error is larger behind clear "
             "enamel without dentine, and in light from behind.";
    case FindingKind::kMeasurementsOutweighed:
      return "In a fit by model `shader` measurements hardly count, because thousands of pixels outweigh them. Fit the "
             "measurements alone, and give that result as --prior.";
    case FindingKind::kLayerNotSeen:
      return "Model `shader` does not see layer " + Quoted(f.names) + ".";
    case FindingKind::kNotConverged:
      return "The fit did not converge.";
    case FindingKind::kChi2:
      return "The reduced chi2 is " + Number(n[0]) + ", above the limit of " + Number(n[1]) +
             ": the model does not explain these " + f.names[0] + " within their errors.";
    case FindingKind::kPatchChi2:
      return "In patches of neighbouring pixels the squared residuals are " + Number(n[0]) +
             " times those of noise (limit " + Number(n[1]) +
             "). The photographs, their calibration and the model contradict each other, or more walks are needed "
             "(--walks).";
    case FindingKind::kRegionChi2:
      return "In image regions (sixteenths of a photograph) the squared residuals are " + Number(n[0]) +
             " times those of noise (limit " + Number(n[1]) +
             "), which smaller patches do not show. The photographs, their calibration and the model contradict each "
             "other.";
    case FindingKind::kStatementContradicted:
      return "The photographs contradict the stated " + std::string(NameOf(static_cast<CalibrationKind>(n[0]))) +
             ", even if their errors were " + Number(n[1]) +
             " times as large as stated. One of them is wrong, or the model does not hold: " + FurthestOff(f) + ".";
    case FindingKind::kLampsContradictScenery: {
      const auto lamps = static_cast<size_t>(n[0]);
      return "In every photograph lit by " + Quoted({f.names.begin(), f.names.begin() + static_cast<long>(lamps)}) +
             ", the tile and scenery are brighter or darker than stated by the same factor, whatever they are made of "
             "(" +
             LevelsOfScenery(f, lamps, 1) +
             "). A lamp, an exposure or the encoding is stated wrongly, and absorption is off by many times this "
             "error.";
    }
    case FindingKind::kSharingRejected:
      return SharingRejected(f);
    case FindingKind::kNothingFitted:
      return "Nothing physical was fitted: no scattering, absorption, thickness or index is identified." +
             (f.names.size() > 1 ? " These " + f.names[0] + " add nothing to " + f.names[1] +
                                       ", which can be used by "
                                       "itself."
                                 : std::string());
    case FindingKind::kAtBound:
      return "At a bound: " + Joined(f.names) + ".";
    case FindingKind::kCaptureNotUsable:
      return "Capture " + Quoted(f.names) + " is not usable by itself; its own report gives the reasons.";
  }
  return "";
}

std::vector<std::string> InWords(const std::vector<Finding>& findings) {
  std::vector<std::string> words;
  for (const Finding& finding : findings) words.push_back(InWords(finding));
  return words;
}

std::string VerdictInWords(const CrownFit& fit) {
  const std::string source = SourceOf(fit);
  std::string verdict;
  const auto add = [&](Status status, const std::string& words) {
    const std::vector<std::string> names = NamesOfStatus(fit, status);
    if (!names.empty()) verdict += (verdict.empty() ? "" : " ") + words + Joined(names) + ".";
  };
  const auto has = [&](FindingKind kind) {
    return std::any_of(fit.reasons.begin(), fit.reasons.end(), [&](const Finding& f) { return f.kind == kind; });
  };
  add(Status::kFitted, "The " + source + " identify ");
  add(Status::kPrior, "Held by the prior, not measured: ");
  add(Status::kNotIdentified, "Not identified by these " + source + ": ");
  add(Status::kAtBound, "At a bound: ");
  if (const std::vector<std::string> names = CountedAsExact(fit); !has(FindingKind::kNothingFitted) && !names.empty())
    verdict += " Taken as exact, with no share in the intervals: " + Joined(names) + ".";
  if (verdict.empty()) verdict = "Nothing was free to fit.";
  if (fit.usable) return verdict;
  const bool model_holds = fit.reasons[0].kind == FindingKind::kNothingFitted;
  return "Not usable: see the reasons. " + (model_holds ? verdict : "If the model held, this would follow: " + verdict);
}

}  // namespace crownfit
