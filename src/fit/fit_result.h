#pragma once
// The result of a fit, as data: material.json, run.json, the summary and the figures are written from it.

#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "capture/capture.h"
#include "fit/finding.h"
#include "fit/fit_options.h"
#include "fit/free_parameters.h"
#include "fit/profile.h"
#include "fit/scattering_laws.h"
#include "fit/solve.h"
#include "fit/uncertainty.h"
#include "fit/walk_comparison.h"
#include "photo/colour_difference.h"

namespace crownfit {

/// One step of a path-traced fit, in the free entries' own scales.
struct WalkedFitStep {
  std::string stage;  ///< "search", "run" or "to the end"
  double paths_per_photograph = 0, reduced_chi2 = 0, block_chi2 = 0;
  Eigen::VectorXd from, step, stddev, stddev_of_walks;
};

struct PhotographResult {
  std::string name;
  bool is_holdout = false, exposure_is_fitted = false;
  double exposure = 1.0;
  double exposure_stddev = 0;  ///< 0: exact, or only random walks could give it
  double level = 1.0;          ///< measured over predicted brightness
  double level_stddev = 0;     ///< from the scatter of patches
  double reduced_chi2 = 0;
  std::optional<ResidualChi2> residual_chi2;  ///< of the fit's photographs, path-traced
  int saturated_pixels = 0;
  Image photograph, prediction;   ///< linear sensor values; the prediction is 0 where nothing was cast
  std::vector<uint8_t> compared;  ///< the pixels in the error figures
  /// Per compared pixel: 1, 2, 3 in the cervical, middle, incisal third of the crown, 0 elsewhere; empty where the
  /// crown's ends are unknown.
  std::vector<uint8_t> thirds;
  ColourTransform rgb_from_sensor;
  ColourDifference difference;
};

/// An instrument's reading, and the fitted material's prediction of it.
struct ReadingResult {
  std::string measurement, quantity;  ///< reflectance, transmittance, lab
  bool is_holdout = false;
  Reading read;
  Spectrum predicted{};
};

/// One iteration of a shader fit.
struct ShaderIteration {
  int cast;             ///< number of the geometry's cast, from 0
  double reduced_chi2;  ///< with Huber's loss, priors and nuisances included
};

/// The kinds of values that a capture may state with an error. Those of one kind were measured alike.
enum class CalibrationKind { kExposure, kIntensity, kPose, kPlace };
inline constexpr std::array kCalibrationKinds{CalibrationKind::kExposure, CalibrationKind::kIntensity,
                                              CalibrationKind::kPose, CalibrationKind::kPlace};
/// Per kind: the factor on its stated errors, raised because the photographs contradict them.
using InflatedErrors = std::array<double, kCalibrationKinds.size()>;

/// Upper limit of the factor. Beyond it the deviation is no measurement error of that kind, or the model is wrong.
inline constexpr double kMostInflated = 10.0;

/// How far a fit moved a value from the one that the capture states.
struct MovedCalibration {
  CalibrationKind kind;
  std::string what;  ///< "the pose of 'front'"
  int freedom = 0;
  double chi2 = 0;   ///< sum of squares in stated standard deviations
  double share = 0;  ///< of exposures and intensities: relative change from the stated value
  double Stddevs() const { return std::sqrt(chi2 / freedom); }
};

/// How much brighter than stated a photograph's tile and scenery are beside the object, by channel.
struct SceneryLevel {
  std::string photograph;
  std::vector<std::string> shows, lights;  ///< names of tile and scenery; of what lights them
  Spectrum ratio{}, stddev{};
  double stated = 0;  ///< standard deviation from the stated errors of exposure and lamps
};

/// One of several captures fitted together.
struct TogetherWith {
  std::string name;                      ///< its folder's name, made unique
  std::vector<FittedParameter> its_own;  ///< what captures do not share: thicknesses, the surface
  double block_chi2 = 0;
  bool usable = false;
};

struct CrownFit {
  Capture capture;  ///< with the overrides applied
  FitOptions options;
  Model model = Model::kShader;  ///< the one it ended with, never auto
  std::string model_choice;      ///< the reason
  bool is_by_walks() const { return model == Model::kPath || model == Model::kDiffusion; }
  Material material;
  Material seen_by_shader;  ///< the nearest material for model `shader`: the viewer shows it
  Uncertainty uncertainty;
  DataEstimate knowledge;  ///< the information of its own photographs on the free entries
  LinearScales scales;
  std::vector<PhotographResult> photographs;
  ResidualChi2 residual_chi2;  ///< of the fit's photographs together, path-traced; no values: another model
  std::vector<ReadingResult> readings;
  std::vector<MovedCalibration> calibration;  ///< where the capture states its errors
  InflatedErrors inflation{1, 1, 1, 1};
  std::vector<LawDeparture> departures;   ///< from scattering that channels share; empty: none is shared, or not tested
  std::vector<SceneryLevel> scenery;      ///< of the photographs that show some
  std::vector<double> mean_thickness_mm;  ///< per layer; at scale 1 where the scale multiplies a field or a mesh
  bool converged = false, usable = false, ends_at_neck = false;
  int iterations = 0, casts = 0;
  std::vector<TogetherWith> together;  ///< the captures that share the material; empty: this one alone
  std::vector<FreeEntry> entries;      ///< the free entries, in the order of `best`, of `steps` and of the covariance
  Eigen::VectorXd best;                ///< in the entries' own scales
  std::vector<LikelihoodProfile> profiles;
  std::vector<ShaderIteration> iterations_by_shader;
  std::vector<WalkedFitStep> steps;  ///< of a path-traced fit
  double walked_paths = 0;
  std::vector<double> rival_roughness;  ///< of other optima as good as the result
  size_t fitted_pixels = 0;
  std::vector<std::string> messages;  ///< what was repaired in the input
  std::vector<std::string> left_out;  ///< parts of the scene, by name
  std::vector<Finding> reasons;       ///< why the result is not usable, and parameters at their bounds
  std::vector<Finding> caveats;       ///< what cannot be trusted
  std::string advice;                 ///< which photograph would add information; empty: nothing is weak, or none would
};

/// Within this distance of the cut at an open scan's neck, pixels count for less.
inline constexpr double kNeckReachMm = 3.0;

/// Limit of the reduced chi2 above which a fit is not usable.
inline constexpr double kChi2Limit = 3.0;

}  // namespace crownfit
