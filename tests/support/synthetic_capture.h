#pragma once
// A complete capture on disk of a known object: an incisor (enamel over dentine) under the light a lab would use.

#include <filesystem>

#include "base/json_file.h"

namespace crownfit {

struct SyntheticCapture {
  int pixels = 64;    ///< width and height of the photographs
  int levels = 40;    ///< levels of the incisor: about 4,000 triangles
  double size = 1.0;  ///< of the tooth, whose coefficients grow as it shrinks, so that it looks the same; light is
                      ///< gathered at as many fewer places
  double initial_factor = 2.0;  ///< how far the free parameters start from the truth
  bool free_thickness = false;
  bool free_exposures = false;  ///< all but the first
};

/// Writes capture.json, truth.json, calib/ and mesh/ to `folder`; photographs are rendered from truth.json afterwards.
void WriteSyntheticCapture(const std::filesystem::path& folder, const SyntheticCapture& options);

}  // namespace crownfit
