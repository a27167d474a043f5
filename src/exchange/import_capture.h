#pragma once
// Makes a capture of a multi-view set that another program calibrated.

#include <filesystem>
#include <string>
#include <vector>

#include "capture/init_capture.h"

namespace crownfit {

struct ImportParts {
  std::filesystem::path source;       ///< folder of a sparse model of COLMAP, or a transforms.json
  std::filesystem::path photographs;  ///< their folder
  double mm_per_unit = 1;             ///< of the source's lengths
  CaptureParts capture;               ///< all but photographs and views; meshes in mm, in the source's axes
};

/// Writes the capture as InitCapture. A light that is named like a photograph is on in it alone, others are on in all.
/// Returns what was left out. Throws InputError.
std::vector<std::string> ImportCapture(ImportParts parts, const std::filesystem::path& folder);

}  // namespace crownfit
