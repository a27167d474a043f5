#pragma once
// Limits on input files, which bound what a broken or hostile file may cost. docs/limits.md.

#include <cstddef>

namespace crownfit {

struct Limits {
  double image_megapixels = 100;
  double image_seconds = 60;          ///< to decode one image, wall-clock time
  double mesh_million_triangles = 5;  ///< after splitting polygons into triangles
  double json_MiB = 64;               ///< also for a manifest in CSV
  double crown_megapixels = 0.25;     ///< the part of a photograph around the crown; larger ones are averaged
};

/// The defaults, or the values of the environment variables CROWNFIT_MAX_IMAGE_MEGAPIXELS, CROWNFIT_MAX_IMAGE_SECONDS,
/// CROWNFIT_MAX_MESH_MILLION_TRIANGLES, CROWNFIT_MAX_JSON_MIB, CROWNFIT_MAX_CROWN_MEGAPIXELS. Throws InputError for a
/// value that is not a positive number.
Limits InputLimits();

}  // namespace crownfit
