#pragma once
// Captures with a known answer: path-traced photographs, sensor noise, and calibration with a stated error.

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "synthetic/recipe.h"

namespace crownfit {

/// Writes capture.json, calibration, meshes, photographs with variance images, PNGs to look at, and truth.json.
/// `progress` gets a stage and a share. Returns remarks for the user.
std::vector<std::string> Synthesize(const Recipe& recipe, const std::filesystem::path& folder, int threads,
                                    const std::function<void(const std::string&, double)>& progress);

}  // namespace crownfit
