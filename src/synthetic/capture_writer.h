#pragma once
// The capture that a recipe describes, with what a user would have: copied meshes, calibration that is wrong by the
// stated errors, parameters that start off.

#include "base/json_file.h"
#include "synthetic/recipe.h"

namespace crownfit {

inline constexpr uint64_t kSynthesisStream = 0x73796e7468ull;  ///< no fit's walks are keyed by it

/// Copies meshes, textures and cameras, writes the light rig; returns the content of capture.json, to be written last.
JsonValue PrepareCapture(const Recipe& recipe, const std::filesystem::path& folder);

/// Recorded over stated exposure of a photograph.
double ExposureError(const Recipe& recipe, size_t photograph);

}  // namespace crownfit
