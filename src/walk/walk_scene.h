#pragma once
// Nested dielectric layers with opaque things around them, as a random walk meets them.

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/absorption_texture.h"
#include "geometry/ray_caster.h"

namespace crownfit {

/// Number of the medium outside everything; the layer i (outermost first) is medium i + 1.
inline constexpr int kOutside = 0;

/// A boundary that ends a flight.
struct Boundary {
  double distance_mm;
  glm::dvec3 position;
  glm::dvec3 normal;    ///< unit, of the facet, outward
  int inside, outside;  ///< media on its two sides
  int opaque = -1;      ///< index of the opaque thing that was met; -1: a layer's surface
  int triangle = -1;
  bool is_cut = false;  ///< closes the neck of an open scan
  int behind(int medium) const { return medium == inside ? outside : inside; }
  /// The medium into which light goes on.
  int towards(const glm::dvec3& direction) const { return glm::dot(direction, normal) < 0 ? inside : outside; }
};

/// A lower bound of the distance to the layers' surfaces, on a grid: most flights are shorter and need no ray.
class Clearance {
 public:
  Clearance() = default;
  /// Cubes of about 1/64 of the longest side.
  Clearance(const RayCaster& layers, const glm::dvec3& low, const glm::dvec3& high, int threads);
  /// The grid as plain numbers, for loops over many places.
  struct Grid {
    double low_x, low_y, low_z, per_mm, cube_mm;
    double count_x, count_y, count_z;
    const float* distance_mm;
    /// The cube that holds a place, and how far the place is from its middle; infinitely far outside all.
    struct Place {
      int cube;
      double off_mm;
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
      return {static_cast<int>((iz * count_y + iy) * count_x + ix), lowest >= 0 ? off_mm : kOutsideAll};
    }
  };
  Grid grid() const {
    return {low_.x,
            low_.y,
            low_.z,
            per_mm_,
            1.0 / per_mm_,
            static_cast<double>(count_.x),
            static_cast<double>(count_.y),
            static_cast<double>(count_.z),
            distance_mm_.data()};
  }
  /// 0 outside the grid.
  double At(const glm::dvec3& p) const {
    if (distance_mm_.empty()) return 0.0;
    const Grid::Place place = grid().Find(p.x, p.y, p.z);
    return std::max(0.0, distance_mm_[place.cube] - place.off_mm);
  }

 private:
  glm::dvec3 low_{0.0};
  glm::ivec3 count_{0};
  double per_mm_ = 0;
  std::vector<float> distance_mm_;  ///< from the cubes' middles
};

/// The layers of an object: closed surfaces, outermost first. Where several hold a point, the innermost wins, and the
/// object is the union of all: dentine may stand out of the enamel as a root.
struct LayeredBody {
  /// `textures`: per layer, or none at all.
  LayeredBody(std::vector<TriangleMesh> layer_surfaces, int threads,
              std::vector<std::shared_ptr<const AbsorptionTexture>> textures = {});
  std::vector<TriangleMesh> surfaces;
  std::vector<std::shared_ptr<const AbsorptionTexture>> absorption;  ///< per layer, where it varies
  /// Per surface and triangle: what lies outside may be another medium than the layer above. Empty for the outermost.
  std::vector<std::vector<uint8_t>> is_exposed;
  glm::dvec3 low, high;  ///< bounding box, wider by what single-precision rays may miss
  Clearance clearance;
};

/// No distances are compared against a tolerance: a layer's surface counts only if its facing agrees with the medium
/// one is in, so that the facet just left can't be met again; an opaque thing, which may be a sheet with two sides, is
/// met from either, but not on the very triangle one leaves. Facets are flat: refraction uses their own normals.
class WalkScene {
 public:
  /// Both must outlive the scene.
  WalkScene(const LayeredBody& body, const std::vector<TriangleMesh>& opaque);

  /// First boundary of `medium` along the way, within `max_mm`. `left`: the opaque boundary one comes from, if any.
  std::optional<Boundary> Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm,
                               const Boundary* left = nullptr) const;

  /// First boundaries of several flights inside, each in its medium.
  void NextOfMany(std::span<const Ray> flights, std::span<const int> media,
                  std::span<std::optional<Boundary>> boundaries) const;

  /// False beyond the outermost surface's bounding box, where no walk should be.
  bool Holds(const glm::dvec3& p) const {
    const glm::dvec3 &a = body_.low, &b = body_.high;
    return p.x >= a.x && p.y >= a.y && p.z >= a.z && p.x <= b.x && p.y <= b.y && p.z <= b.z;
  }
  int layers() const { return layers_; }

 private:
  bool Counts(int mesh, int triangle, const glm::dvec3& direction, int medium, const Boundary* left) const;
  Boundary BoundaryAt(const Hit& hit, int medium) const;
  int MediumOutside(int surface, const glm::dvec3& place, const glm::dvec3& normal) const;
  const LayeredBody& body_;
  int layers_;
  std::vector<const TriangleMesh*> meshes_;
  std::vector<std::vector<glm::dvec3>> normals_;
  RayCaster caster_{{}};
};

}  // namespace crownfit
