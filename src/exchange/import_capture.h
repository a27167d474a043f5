#pragma once
// Makes a capture of a multi-view set that another program calibrated.

#include <filesystem>
#include <string>
#include <vector>

#include "capture/init_capture.h"
#include "exchange/imported_views.h"

namespace crownfit {

struct ImportParts {
  /// Folder of a sparse model of COLMAP, a transforms.json, or scenes of Mitsuba: files or a folder of them.
  std::vector<std::filesystem::path> sources;
  std::vector<ImportedView> views;    ///< where they are known without `sources`
  std::filesystem::path photographs;  ///< their folder
  double mm_per_unit = 1;             ///< of the source's lengths
  CaptureParts capture;  ///< all but photographs and views; meshes in mm, in the source's axes. Without meshes or
                         ///< lights those of a scene are taken.
};

/// Names of the pictures in a folder, in their order.
std::vector<std::string> PhotographsIn(const std::filesystem::path& folder);

/// Millimetres of a unit, from "X,Y,Z:X,Y,Z=MM": two points and their distance. Throws InputError.
double ScaleFromPoints(const std::string& text);

/// Writes the capture as InitCapture. A light that is named like a photograph is on in it alone, others are on in all;
/// lamps of a scene are on in its photographs. Returns what was left out. Throws InputError.
std::vector<std::string> ImportCapture(ImportParts parts, const std::filesystem::path& folder);

}  // namespace crownfit
