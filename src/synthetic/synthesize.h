#pragma once
// Captures with a known answer: photographs by the path model, sensor noise, calibration that is wrong by a stated
// amount.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/capture.h"

namespace crownfit {

struct CalibrationError {
  double exposure = 0;               ///< relative
  double pose_deg = 0, pose_mm = 0;  ///< per axis, about and along the camera's axes
  double light_mm = 0;               ///< per axis
  bool any() const { return exposure > 0 || pose_deg > 0 || pose_mm > 0 || light_mm > 0; }
};

/// "synthesis" of a recipe; every error is one standard deviation.
struct Recipe {
  Capture capture;  ///< every parameter at its true value
  int paths_per_pixel = 512;
  double noise_relative = 0.01, noise_floor = 0.0005;
  uint64_t seed = 1;
  double initial_factor = 2.0;
  std::vector<std::string> free;  ///< "layer.key", "surface.key"
  CalibrationError error;
};

/// Throws InputError; a parameter that is not fixed is one.
Recipe ReadRecipe(const std::filesystem::path& file);

/// Writes capture.json, calibration, meshes, photographs with variance images, PNGs to look at, and truth.json.
/// `progress` gets a stage and a share. Returns remarks for the user.
std::vector<std::string> Synthesize(const Recipe& recipe, const std::filesystem::path& folder, int threads,
                                    const std::function<void(const std::string&, double)>& progress);

}  // namespace crownfit
