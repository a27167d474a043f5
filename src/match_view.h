#pragma once
// Parameters with which the real-time shader looks as the path model does with a material's own.

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
  int pixels = 64;  ///< of a picture's side
  uint64_t seed = 1;
  int threads = 0;
};

struct ViewMatch {
  struct View {
    std::string name;
    bool is_holdout;
    ColourDifference physical, effective;  ///< of the shader with either material against the path model
  };
  Material effective;           ///< scattering and absorption of the two outer layers differ from the material's own
  bool keeps_physical = false;  ///< as nothing found was nearer under the lights that are matched
  std::vector<View> views;
};

/// Renders the material by walks under StudioCapture's light and fits the shader to it. Throws InputError.
ViewMatch MatchView(const Capture& capture, const Material& material, const MatchOptions& options, Progress& progress);

/// As a table to print.
std::string MatchSummary(const ViewMatch& match, const Material& material);

/// The material's file with the match as its block "viewer".
std::string MaterialJsonWithMatch(const std::filesystem::path& material_file, const ViewMatch& match,
                                  const MatchOptions& options);

}  // namespace crownfit
