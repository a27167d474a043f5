#pragma once
// A regular grid over the layers' surfaces: how far the nearest one is, which proves most flights free, and which
// facets reach into each cube, which finds what the others meet, in double precision and without a leak.

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "geometry/ray_caster.h"

namespace crownfit {

/// A flight, and the first facet that ends it.
struct FacetFlight {
  glm::dvec3 origin, direction;  ///< a unit vector
  int medium;                    ///< 0 outside, else layer + 1
  double max_mm;
  // Found:
  double distance_mm = kFar;  ///< of the facet; infinite when none is met
  glm::dvec3 normal{0.0};     ///< unit, of the facet, outward
  int mesh = -1, triangle = -1;
  bool is_ended() const { return mesh >= 0; }
};

class FacetGrid {
 public:
  FacetGrid() = default;
  /// `surfaces`: layers, outermost first, their vertices representable in single precision (LayeredBody's are).
  /// `is_exposed`: per surface and triangle, whether its outside may be any medium further out than the layer above;
  /// empty for a surface where none is.
  FacetGrid(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed,
            const glm::dvec3& low, const glm::dvec3& high, int threads);

  /// Distances as plain numbers, for loops over many places.
  struct Distances {
    double low_x, low_y, low_z, per_mm, cube_mm;
    double count_x, count_y, count_z;
    const float* distance_mm;  ///< from the cubes' middles to the nearest surface, a lower bound
    const float* slab;         ///< per cube 8 numbers: Slab
    double reach2_mm2;         ///< its ball's radius squared
    /// The cube that holds a place, and how far the place is from its middle; infinitely far outside all.
    struct Place {
      int cube;
      double off_mm;
      double middle_x, middle_y, middle_z;
    };
    static constexpr double kOutsideAll = 1e300;
    [[gnu::always_inline]] Place Find(double x, double y, double z) const {
      const double qx = (x - low_x) * per_mm, qy = (y - low_y) * per_mm, qz = (z - low_z) * per_mm;
      // One choice at a time, which compilers turn into vector instructions.
      const double ax = qx >= 0 ? qx : -1.0, ay = qy >= 0 ? qy : -1.0, az = qz >= 0 ? qz : -1.0;
      const double bx = ax < count_x ? ax : -1.0, by = ay < count_y ? ay : -1.0, bz = az < count_z ? az : -1.0;
      const double low = bx < by ? bx : by, lowest = low < bz ? low : bz;
      const double cx = bx >= 0 ? bx : 0.0, cy = by >= 0 ? by : 0.0, cz = bz >= 0 ? bz : 0.0;
      const double ix = static_cast<int>(cx), iy = static_cast<int>(cy), iz = static_cast<int>(cz);
      const double ox = cx - ix - 0.5, oy = cy - iy - 0.5, oz = cz - iz - 0.5;
      const double off_mm = cube_mm * std::sqrt(ox * ox + oy * oy + oz * oz);
      return {static_cast<int>((iz * count_y + iy) * count_x + ix), lowest >= 0 ? off_mm : kOutsideAll,
              low_x + cube_mm * (ix + 0.5), low_y + cube_mm * (iy + 0.5), low_z + cube_mm * (iz + 0.5)};
    }
  };
  Distances distances() const {
    return {low_.x,
            low_.y,
            low_.z,
            per_mm_,
            1.0 / per_mm_,
            static_cast<double>(count_.x),
            static_cast<double>(count_.y),
            static_cast<double>(count_.z),
            distance_mm_.data(),
            &slabs_.data()->nx,
            kReach * kReach / (per_mm_ * per_mm_)};
  }
  /// Between two parallel planes lies all of the surfaces within kReach cubes around a cube's middle: a flight that
  /// stays in that ball and on one side meets nothing.
  struct alignas(32) Slab {
    float nx = 0, ny = 0, nz = 1, low = -std::numeric_limits<float>::infinity(),
          high = std::numeric_limits<float>::infinity();
  };

  /// Finds the first facet that ends each flight: met from behind if it bounds the flight's medium, from in front if
  /// its outside may be the medium. Nothing beyond the grid is found. Flights side by side wait for memory together.
  void FindEnds(std::span<FacetFlight> flights) const;

 private:
  static constexpr int kPack = 16;
  /// The planes of some facets that bound the same media, side by side and as seen from the cube's middle: a quick and
  /// generous first choice. The others are empty: offset infinite.
  struct alignas(64) Pack {
    std::array<float, kPack> nx{}, ny{}, nz{}, offset;
    std::array<int32_t, kPack> facet{};
    int inside = 0, outermost = 0;  ///< medium behind, and the first of those in front, which end at inside - 1
  };
  struct alignas(64) Facet {
    glm::dvec3 normal;
    std::array<glm::vec3, 3> corners;
    int32_t triangle;
  };
  static constexpr double kReach = 1.5;
  void FindSlabs();
  std::pair<double, double> WithinSlab(const FacetFlight& flight) const;
  void FindSomeEnds(std::span<FacetFlight> flights) const;
  void FindDistances(const std::vector<TriangleMesh>& surfaces, int threads);
  void ListFacets(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed);

  glm::dvec3 low_{0.0};
  glm::ivec3 count_{0};
  double per_mm_ = 0;
  std::vector<float> distance_mm_;
  std::vector<Slab> slabs_;
  std::vector<Facet> facets_;
  std::vector<uint32_t> first_pack_;  ///< per cube and one more
  std::vector<Pack> packs_;
};

}  // namespace crownfit
