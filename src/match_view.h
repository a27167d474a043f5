#pragma once
// Parameters with which the real-time shader looks like the path model with a material's own parameters.

#include <filesystem>
#include <string>
#include <vector>

#include "base/progress.h"
#include "capture/capture.h"
#include "optics/material.h"
#include "photo/colour_difference.h"

namespace crownfit {

struct MatchOptions {
  int paths_per_pixel = 400;
  int pixels = 64;  ///< width and height of a picture
  uint64_t seed = 1;
  int threads = 0;
};

struct ViewMatch {
  struct View {
    std::string name;
    bool is_holdout;
    ColourDifference physical, effective;  ///< the shader with either material, against the path model
  };
  Material effective;           ///< scattering and absorption of the two outer layers differ from the material's own
  bool keeps_physical = false;  ///< no candidate was nearer under the matched lights
  std::vector<View> views;
};

/// Path-traces the material under StudioCapture's light and fits the shader to it. Throws InputError.
ViewMatch MatchView(const Capture& capture, const Material& material, const MatchOptions& options, Progress& progress);

/// The match as a table to print.
std::string MatchSummary(const ViewMatch& match, const Material& material);

/// The material file's content, with the match as its block "viewer".
std::string MaterialJsonWithMatch(const std::filesystem::path& material_file, const ViewMatch& match,
                                  const MatchOptions& options);

}  // namespace crownfit
