#pragma once
// A synthetic capture around meshes, to show a material on them.

#include <filesystem>
#include <vector>

#include "capture/capture.h"

namespace crownfit {

/// `meshes`: surfaces of the material's layers, outermost first; layers without one are inward offsets by the
/// material's thickness. It has one virtual photograph: the camera looks along -z with y up, from three times the
/// crown's size away; two softboxes and a weak dome, black surroundings. Throws InputError.
Capture CaptureOfMeshes(const std::vector<std::filesystem::path>& meshes, const std::filesystem::path& material_file);

}  // namespace crownfit
