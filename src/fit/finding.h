#pragma once
// Findings of a fit about itself and its input, as data; report/finding_words.h puts them into words.

#include <string>
#include <vector>

namespace crownfit {

/// Each kind lists the contents of Finding::numbers (N) and of Finding::names.
enum class FindingKind {
  // Photographs and their files.
  kWhiteBalanceDiffers,  ///< names: two photographs
  kForeignPrimaries,     ///< names: the photograph, its encoding
  kTransparentPixels,    ///< N: pixels; names: the photograph
  kFalseColours,         ///< N: the channels' wavelengths, nm
  kNoColour,             ///< the same
  kLightNotCalibrated,   ///< display-encoded photographs
  kJpeg,                 ///< names: photographs
  kColourNotCalibrated,  ///< display-encoded photographs without a colour file
  kEveryExposureFree,
  kNoiseAssumed,
  // Contradictions between photographs and what the capture states.
  kCalibrationMoved,  ///< N: distance in stated errors; names: of what
  kErrorsInflated,    ///< N: CalibrationKind, factor, then of the furthest: kCalibrationMoved's N, share; names: it
  kPhotographLevel,   ///< N: measured over predicted brightness; names: the photograph
  kHoldoutLevel,      ///< the same for a held-out photograph
  kPhotographsNotExplained,  ///< names: photographs; N: for each, chi2 of patches and regions, 0 if explained by noise
  kSceneryOff,               ///< names: photographs; N: for each, measured over predicted brightness by channel
  kPriorsContradicted,       ///< names: entries; N: by how many standard deviations
  kCapturesDisagree,         ///< names: capture, entry; N: chi2, degrees of freedom, value alone, value by the others
  // What the model leaves out, and how the fit was made.
  kOpenNeck,             ///< N: reach of the assumed surroundings, mm
  kPartLeftOut,          ///< names: the part; N: empty where it was requested, else CIEDE2000 and standard deviations
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
  kStatementContradicted,   ///< N: CalibrationKind, largest factor tried, then as kErrorsInflated; names: likewise
  kLampsContradictScenery,  ///< N: number of lamps, then as kSceneryOff; names: lamps, then photographs
  kSharingRejected,   ///< N: whether one value was shared, then each channel's departure, %; names: the parameter, the
                      ///< law to try, the data that reject it
  kNothingFitted,     ///< names: the data, and the prior's file where it determines everything
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
