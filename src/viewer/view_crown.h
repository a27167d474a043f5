#pragma once
// Draws the crown in the light of a capture's photographs on the graphics processor.

#include <filesystem>
#include <optional>
#include <string>

#include "base/progress.h"
#include "capture/capture.h"
#include "optics/material.h"

namespace crownfit {

struct ViewOptions {
  size_t photograph = 0;                            ///< whose camera and lamps
  std::optional<std::pair<int, int>> size;          ///< of the picture; else the camera's own
  std::optional<std::filesystem::path> screenshot;  ///< .exr: linear pixel values; .png: to look at
  int benchmark_frames = 0;
  int threads = 0;
};

/// Draws without a display. Returns the text to print: the driver's name, frame times.
std::string ViewCrown(const Capture& capture, const Material& material, const ViewOptions& options, Progress& progress);

}  // namespace crownfit
