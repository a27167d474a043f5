#pragma once
// Many paths at once. Flights and collisions run in lanes, as they need no decisions. Boundaries, lamps and roulette
// run one path after the other.

#include <functional>
#include <vector>

#include "path/camera_path.h"
#include "path/flight_lanes.h"

namespace crownfit {

/// Where a path starts.
struct PathStart {
  glm::dvec3 position, direction;
  int hero;
  RandomStream random;
};

/// Traces paths 0 ... count - 1, at most `lanes` at once. Passes on each when it ends, in any order. Every path's
/// numbers depend on its start alone. Without lanes: one after the other by rays alone, without derivatives; this is
/// the simple reference implementation.
void TracePaths(const PathContext& context, const TriangleGrid& grid, size_t count, int lanes,
                const std::function<PathStart(size_t)>& start,
                const std::function<void(size_t, const CameraPath&)>& ended, WalkCounters& counters);

}  // namespace crownfit
