#pragma once
// Options of path-traced photographs.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "diffusion/volume_lattice.h"

namespace crownfit {

/// How camera walks find the lamps.
enum class Estimator {
  kExits,       ///< when they leave the object
  kCollisions,  ///< at every collision, from light that has not collided yet (uncollided_light.h)
};

/// How light is followed from the lamps to its first collision (uncollided_light.h).
struct UncollidedOptions {
  int rays = 0;        ///< of all lamps of a photograph; 0: as many as make its noise small against that of the walks
  double cell_mm = 0;  ///< 0: two free paths where light collides first
};

inline constexpr size_t kMaxPhotographs = 32;  // photographs of one RenderTogether

struct PathOptions {
  int paths_per_pixel = 256;      ///< rounded up to whole groups of heroes
  uint64_t seed = 1, stream = 0;  ///< streams separate synthetic photographs from the fit's own random walks
  int threads = 0;
  int lanes =
      64;  ///< paths side by side; affects only the time. 0: one after the other, by rays alone (no derivatives)
  bool derivatives = false;   ///< compute derivatives too
  bool keeps_groups = false;  ///< keep the values of groups of paths; with derivatives they are kept anyway
  /// False: lamps are found only by paths that hit them.
  bool lamps_are_sampled = true;
  Estimator estimator = Estimator::kExits;
  /// Model `diffusion`: walks end after this many collisions and switch to diffusion. The light was followed from the
  /// lamps through as many collisions, and solved for on this lattice over the body (light_field.h). Without a lattice
  /// walks run to their end.
  const VolumeLattice* lattice = nullptr;
  int collisions = 10;
  int rays = 40000;    ///< light rays per lamp; their noise is common to all walks
  uint64_t field = 0;  ///< which rays: the same in pictures that must differ smoothly
  UncollidedOptions uncollided = {};
  /// Pixels to render (index y * width + x). Empty: all.
  std::vector<uint8_t> wanted = {};
};

}  // namespace crownfit
