#pragma once
// What a backing tile sees of the object.

#include <vector>

#include "calibration/capture.h"
#include "geometry/crown.h"

namespace crownfit {

/// The share of the cosine-weighted hemisphere that the object fills, seen from places on the tile: how much of the
/// light that a uniformly glowing object sends to the tile arrives per area. Tabulated on a grid.
class TileView {
 public:
  TileView(const Crown& crown, const BackingSpec& tile, int threads);
  double At(const glm::dvec3& place) const;

 private:
  static constexpr int kCells = 40;
  glm::dvec3 corner_, along_u_, along_v_;  ///< steps of one cell
  std::vector<double> share_;              ///< at the cells' corners
};

}  // namespace crownfit
