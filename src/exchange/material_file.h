#pragma once
// Material files of other runs.

#include <filesystem>

#include "optics/material.h"

namespace crownfit {

/// Reads the values of material.json or truth.json ("crownfit-material/1") for the layers of a capture, by name; what
/// the file does not state keeps the capture's value. Throws InputError when a layer is missing.
Material ReadMaterialFile(const std::filesystem::path& file, const Capture& capture);

}  // namespace crownfit
