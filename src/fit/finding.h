#pragma once
// What a fit has found out about itself and its input, as data; report/finding_words.h says it.

#include <string>
#include <vector>

namespace crownfit {

/// Behind each: what Finding::numbers holds (N) and what Finding::names holds.
enum class FindingKind {
  // Photographs and their files.
  kWhiteBalanceDiffers,  ///< names: two photographs
  kProfileIgnored,       ///< names: the photograph
  kFalseColours,         ///< N: the channels' wavelengths, nm
  kLightNotCalibrated,   ///< display-encoded photographs
  kJpeg,                 ///< names: photographs
  kColourNotCalibrated,  ///< display-encoded photographs without a colour file
  kEveryExposureFree,
  kNoiseAssumed,
  // What photographs say against what the capture states.
  kCalibrationMoved,  ///< N: by how many stated errors; names: what
  kErrorsInflated,    ///< N: CalibrationKind, factor, then as kCalibrationMoved of the furthest, its share; names: it
  kPhotographLevel,   ///< N: brighter than predicted by this factor; names: the photograph
  kHoldoutLevel,      ///< the same of one that was held out
  kPhotographsNotExplained,  ///< names: photographs; N: for each, squares over those of noise in patches and in image
                             ///< regions, 0 where noise explains them
  kSceneryOff,               ///< names: photographs; N: for each, brighter than predicted by channel
  kPriorsContradicted,       ///< names: entries; N: by how many standard deviations
  kCapturesDisagree,         ///< names: capture, entry; N: chi2, freedom, value alone, value by the others
  // What the model leaves out, and how the fit was made.
  kOpenNeck,             ///< N: reach of what is assumed there, mm
  kPartLeftOut,          ///< names: the part; N: nothing where it was asked for, else CIEDE2000 and standard deviations
  kSwitchesToDiffusion,  ///< N: collisions
  kNotMovedByWalks,      ///< names: the entry
  kRivalRoughness,       ///< N: the other roughness
  kNoisyIntervals,       ///< names: entries; N: paths per photograph
  kLayeredAssumptions,
  kFewReadings,
  kShaderAssumptions,
  kMeasurementsOutweighed,
  kLayerNotSeen,  ///< names: the layer
  // Why a result must not be used.
  kNotConverged,
  kChi2,                    ///< N: reduced chi2, limit; names: of what
  kPatchChi2,               ///< N: chi2 of patches, limit
  kRegionChi2,              ///< N: chi2 of image regions, limit
  kStatementContradicted,   ///< N: CalibrationKind, largest factor that was tried, then as kErrorsInflated; names:
                            ///< likewise
  kLampsContradictScenery,  ///< N: how many lamps, then as kSceneryOff; names: lamps, then photographs
  kSharingRejected,   ///< N: whether one value was shared, then each channel's departure, %; names: the parameter,
                      ///< the law to try, by what it is rejected
  kNothingFitted,     ///< names: of what, and the prior's file where it says everything
  kAtBound,           ///< names: parameters; not a reason by itself
  kCaptureNotUsable,  ///< names: the capture, of several
};

struct Finding {
  FindingKind kind;
  std::vector<double> numbers = {};
  std::vector<std::string> names = {};
  bool operator==(const Finding&) const = default;
};

}  // namespace crownfit
