#include "scene/tile_view.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "capture/capture.h"
#include "scene/light_samples.h"

namespace crownfit {

TileGrid::TileGrid(const BackingSpec& tile) {
  const auto [u, v] = Tangents(tile.normal);
  along_u_ = tile.size_mm / kCells * u;
  along_v_ = tile.size_mm / kCells * v;
  corner_ = tile.point_mm - 0.5 * kCells * (along_u_ + along_v_);
}

glm::dvec3 TileGrid::Place(size_t number) const {
  const size_t column = number % (kCells + 1), row = number / (kCells + 1);
  return corner_ + static_cast<double>(column) * along_u_ + static_cast<double>(row) * along_v_;
}

TileGrid::Around TileGrid::At(const glm::dvec3& point) const {
  const auto cell = [&](const glm::dvec3& along) {
    return std::clamp(glm::dot(point - corner_, along) / glm::dot(along, along), 0.0, kCells - 1e-9);
  };
  const double x = cell(along_u_), y = cell(along_v_);
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const double fx = x - i, fy = y - j;
  const size_t row = kCells + 1, first = static_cast<size_t>(j) * row + static_cast<size_t>(i);
  return {{first, first + 1, first + row, first + row + 1},
          {(1 - fy) * (1 - fx), (1 - fy) * fx, fy * (1 - fx), fy * fx}};
}

std::vector<double> ObjectSeenFrom(const TileGrid& grid, const glm::dvec3& normal, const Crown& crown, int threads) {
  constexpr int kStrata = 8;
  constexpr double kLift_mm = 1e-3;
  std::vector<double> share(TileGrid::count(), 0.0);
  ParallelFor(share.size(), threads, [&](size_t i) {
    const glm::dvec3 place = grid.Place(i) + kLift_mm * normal;
    std::vector<LightSample> sky;
    SampleLight(DomeLight{Spectrum(1.0)}, place, normal, kStrata, sky);
    for (const LightSample& s : sky)
      if (crown.fine_caster.Nearest(place, s.direction)) share[i] += 1.0 / static_cast<double>(sky.size());
  });
  return share;
}

}  // namespace crownfit
