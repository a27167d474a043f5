#pragma once
// A regular grid over the layers' surfaces. Distances to the nearest surface prove most flights free. Lists of the
// facets in each cube give the end of the others, in double precision.

#include <algorithm>
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
  double distance_mm = kFar;  ///< to the facet; infinite when none is met
  glm::dvec3 normal{0.0};     ///< unit normal of the facet, outward
  int mesh = -1, triangle = -1;
  bool is_ended() const { return mesh >= 0; }
};

/// Cubes that fill a box, row by row.
struct CubeGrid {
  glm::dvec3 low{0.0};
  glm::ivec3 count{0};
  double per_mm = 0;

  double cube_mm() const { return 1.0 / per_mm; }
  size_t number(const glm::ivec3& c) const { return (static_cast<size_t>(c.z) * count.y + c.y) * count.x + c.x; }
  glm::dvec3 middle(const glm::ivec3& c) const { return low + (glm::dvec3(c) + 0.5) * cube_mm(); }
  glm::dvec3 InCubes(const glm::dvec3& p) const { return (p - low) * per_mm; }
  bool Holds(const glm::dvec3& in_cubes) const {
    const glm::dvec3& p = in_cubes;
    return p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < count.x && p.y < count.y && p.z < count.z;
  }
  glm::ivec3 Nearest(const glm::dvec3& p) const {
    return glm::clamp(glm::ivec3(glm::floor(InCubes(p))), glm::ivec3(0), count - 1);
  }
  /// Calls visit(number, middle) for all cubes that overlap a box.
  template <class Visit>
  void ForCubes(const glm::dvec3& box_low, const glm::dvec3& box_high, const Visit& visit) const {
    const glm::ivec3 from = Nearest(box_low), to = Nearest(box_high);
    for (int z = from.z; z <= to.z; ++z)
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) visit(number({x, y, z}), middle({x, y, z}));
  }
};

class TriangleGrid {
 public:
  TriangleGrid() = default;
  /// `surfaces`: layers, outermost first, their vertices representable in single precision (LayeredBody's are).
  /// `is_exposed`: per surface and triangle, whether its outside may be any medium further out than the layer above;
  /// empty for a surface where none is.
  TriangleGrid(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed,
               const glm::dvec3& low, const glm::dvec3& high, int threads);

  /// Distances as plain numbers, for loops over many points.
  struct Distances {
    double low_x, low_y, low_z, per_mm, cube_mm;
    double count_x, count_y, count_z;
    const float* distance_mm;  ///< from the cubes' middles to the nearest surface, a lower bound
    const float* slab;         ///< per cube 8 numbers: Slab
    double reach2_mm2;         ///< squared radius of the slab's ball
    /// The cube that holds a point, and the point's distance from its middle; infinite outside the grid.
    struct Place {
      int cube;
      double off_mm;
      double middle_x, middle_y, middle_z;
    };
    static constexpr double kOutsideAll = 1e300;
    [[gnu::always_inline]] Place Find(double x, double y, double z) const {
      const double qx = (x - low_x) * per_mm, qy = (y - low_y) * per_mm, qz = (z - low_z) * per_mm;
      // One selection at a time, which compilers vectorise.
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
    const glm::dvec3 count(cubes_.count);
    return {cubes_.low.x,
            cubes_.low.y,
            cubes_.low.z,
            cubes_.per_mm,
            cubes_.cube_mm(),
            count.x,
            count.y,
            count.z,
            distance_mm_.data(),
            &slabs_.data()->nx,
            kReach * kReach * cubes_.cube_mm() * cubes_.cube_mm()};
  }
  /// Two parallel planes that enclose all surfaces within kReach cubes around a cube's middle. A flight that stays in
  /// that ball and on one side meets nothing.
  struct alignas(32) Slab {
    float nx = 0, ny = 0, nz = 1, low = -std::numeric_limits<float>::infinity(),
          high = std::numeric_limits<float>::infinity();
  };

  /// Whether distances alone prove that a flight inside meets nothing.
  bool IsFree(const glm::dvec3& from, const glm::dvec3& direction, double length_mm) const {
    const Distances d = distances();
    const glm::dvec3 to = from + length_mm * direction;
    const Distances::Place a = d.Find(from.x, from.y, from.z), b = d.Find(to.x, to.y, to.z);
    return length_mm < std::max(0.0, static_cast<double>(d.distance_mm[a.cube]) - a.off_mm) +
                           std::max(0.0, static_cast<double>(d.distance_mm[b.cube]) - b.off_mm);
  }

  /// Finds the first facet that ends each flight. It is met from behind if it bounds the flight's medium, from in front
  /// if its outside may be the medium. Nothing beyond the grid is found. Processing flights together hides memory
  /// latency.
  void FindEnds(std::span<FacetFlight> flights) const;

 private:
  static constexpr int kPack = 16;
  /// The planes of some facets that bound the same media, side by side, relative to the cube's middle: a fast,
  /// conservative first test. Unused entries have an infinite offset.
  struct alignas(64) Pack {
    std::array<float, kPack> nx{}, ny{}, nz{}, offset;
    std::array<int32_t, kPack> facet{};
    int inside = 0, outermost = 0;  ///< medium behind, and the first of those in front; the last of those is inside - 1
  };
  struct alignas(64) Facet {
    glm::dvec3 normal;
    std::array<glm::vec3, 3> corners;
    int32_t triangle;
    /// Height of its plane above a point, along the normal.
    double Above(const glm::dvec3& p) const { return glm::dot(normal, glm::dvec3(corners[0]) - p); }
    std::pair<glm::dvec3, glm::dvec3> Box() const {
      return {glm::min(glm::min(corners[0], corners[1]), corners[2]),
              glm::max(glm::max(corners[0], corners[1]), corners[2])};
    }
  };
  // In units of cubes:
  static constexpr double kListed = 4e-6;  ///< facets are also listed in cubes that they miss by this much
  static constexpr double kReach = 2.0;
  /// Facets that bound the same media.
  struct Group {
    size_t first;
    int inside, outermost;
  };
  // triangle_grid_build.cpp
  void FindDistances(const std::vector<TriangleMesh>& surfaces, int threads);
  std::vector<Group> GatherFacets(const std::vector<TriangleMesh>& surfaces,
                                  const std::vector<std::vector<uint8_t>>& is_exposed);
  void ListFacets(const std::vector<Group>& groups);
  void FindSlabs();

  std::pair<double, double> WithinSlab(const FacetFlight& flight) const;
  void FindSomeEnds(std::span<FacetFlight> flights) const;

  CubeGrid cubes_;
  std::vector<float> distance_mm_;
  std::vector<Slab> slabs_;
  std::vector<Facet> facets_;
  std::vector<uint32_t> first_pack_;  ///< per cube, and one more
  std::vector<Pack> packs_;
};

}  // namespace crownfit
