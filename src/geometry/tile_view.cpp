#include "geometry/tile_view.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "geometry/light_samples.h"

namespace crownfit {

TileView::TileView(const Crown& crown, const BackingSpec& tile, int threads) {
  constexpr int kStrata = 8;
  constexpr double kLift_mm = 1e-3;
  const auto [u, v] = Tangents(tile.normal);
  along_u_ = tile.size_mm / kCells * u;
  along_v_ = tile.size_mm / kCells * v;
  corner_ = tile.point_mm - 0.5 * kCells * (along_u_ + along_v_);
  const auto [low, high] = Bounds(crown.fine);
  const glm::dvec3 normal = glm::dot(0.5 * (low + high) - tile.point_mm, tile.normal) < 0 ? -tile.normal : tile.normal;
  share_.assign((kCells + 1) * (kCells + 1), 0.0);
  ParallelFor(share_.size(), threads, [&](size_t i) {
    const glm::dvec3 place = corner_ + static_cast<double>(i % (kCells + 1)) * along_u_ +
                             static_cast<double>(i / (kCells + 1)) * along_v_ + kLift_mm * normal;
    std::vector<LightSample> sky;
    SampleLight(DomeLight{glm::dvec3(1.0)}, place, normal, kStrata, sky);
    for (const LightSample& s : sky)
      if (crown.fine_caster.Nearest(place, s.direction)) share_[i] += 1.0 / static_cast<double>(sky.size());
  });
}

double TileView::At(const glm::dvec3& place) const {
  const auto cell = [&](const glm::dvec3& along) {
    return std::clamp(glm::dot(place - corner_, along) / glm::dot(along, along), 0.0, kCells - 1e-9);
  };
  const double x = cell(along_u_), y = cell(along_v_);
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const auto at = [&](int k, int l) { return share_[static_cast<size_t>(l) * (kCells + 1) + k]; };
  const double fx = x - i, fy = y - j;
  return (1 - fy) * ((1 - fx) * at(i, j) + fx * at(i + 1, j)) + fy * ((1 - fx) * at(i, j + 1) + fx * at(i + 1, j + 1));
}

}  // namespace crownfit
