#pragma once
// How photographs are rendered by random walks.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "diffusion/volume_lattice.h"

namespace crownfit {

inline constexpr size_t kMaxPhotographs = 32;  // by one RenderTogether

struct PathOptions {
  int paths_per_pixel = 256;      ///< rounded up to whole groups of heroes
  uint64_t seed = 1, stream = 0;  ///< streams keep synthetic photographs apart from any fit's own walks
  int threads = 0;
  int lanes =
      64;  ///< paths side by side; changes nothing but the time. 0: one after the other by rays alone (no derivatives)
  bool derivatives = false;   ///< derivatives beside the values
  bool keeps_groups = false;  ///< values of groups of paths; with derivatives they are kept anyway
  /// False: lamps are found by the directions that paths take and by nothing else.
  bool lamps_are_sampled = true;
  /// Light leaves a smooth surface as diffuse light would: several times less noise from lamps, and values that are
  /// wrong by a few per cent, smoothly over the object. Good enough for derivatives of ln(pixel).
  bool diffuse_exits = false;
  /// Model `diffusion`: walks end after so many collisions, and are handed over to light that was followed from the
  /// lamps through as many and is diffuse from then on, found on this lattice over the body (light_field.h). Without
  /// one they go on to their end.
  const VolumeLattice* lattice = nullptr;
  int collisions = 10;
  int rays = 40000;    ///< of each lamp, by which light is followed: their noise is common to all walks
  uint64_t field = 0;  ///< which rays: the same in pictures that are to differ smoothly
  /// Places that are rendered (index y * width + x). Empty: all.
  std::vector<uint8_t> wanted = {};
};

}  // namespace crownfit
