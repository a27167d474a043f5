#pragma once
// The capture of a recipe as a user would have it: copied meshes, calibration with the stated errors, parameters with
// displaced starts.

#include "base/json_file.h"
#include "synthetic/recipe.h"

namespace crownfit {

inline constexpr uint64_t kSynthesisStream = 0x73796e7468ull;  ///< no fit's random paths use this key

/// Copies meshes, textures and cameras, writes the light rig; returns the content of capture.json, to be written last.
JsonValue PrepareCapture(const Recipe& recipe, const std::filesystem::path& folder);

/// Ratio of recorded to stated exposure of a photograph.
double ExposureError(const Recipe& recipe, size_t photograph);

}  // namespace crownfit
