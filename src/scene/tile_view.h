#pragma once
// A backing tile, tabulated: what it sees of the object, and its radiance.

#include <array>
#include <vector>

#include "scene/crown.h"

namespace crownfit {

struct BackingSpec;

/// A grid of points on a square tile, between which tables are interpolated.
class TileGrid {
 public:
  explicit TileGrid(const BackingSpec& tile);
  static constexpr size_t count() { return static_cast<size_t>(kCells + 1) * (kCells + 1); }
  glm::dvec3 Place(size_t number) const;

  /// The places around a point of the tile and their bilinear weights.
  struct Around {
    std::array<size_t, 4> place;
    std::array<double, 4> weight;
  };
  Around At(const glm::dvec3& point) const;

 private:
  static constexpr int kCells = 40;
  glm::dvec3 corner_, along_u_, along_v_;  ///< steps of one cell
};

/// Per place, the fraction of the cosine-weighted hemisphere that the object fills: the relative irradiance on the tile
/// from a uniformly glowing object. `normal`: towards the object.
std::vector<double> ObjectSeenFrom(const TileGrid& grid, const glm::dvec3& normal, const Crown& crown, int threads);

}  // namespace crownfit
