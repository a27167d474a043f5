#pragma once
// A recipe: a capture whose every value is known, and how to make its photographs.

#include <filesystem>
#include <string>
#include <vector>

#include "capture/capture.h"

namespace crownfit {

/// How wrong a synthetic capture's calibration files are.
struct SynthesisErrors {
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
  SynthesisErrors error;
};

/// Throws InputError, also for a parameter that is not fixed.
Recipe ReadRecipe(const std::filesystem::path& file);

}  // namespace crownfit
