#pragma once
// Nested dielectric layers with opaque things around them, as a random walk meets them.

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
  /// 0 outside the grid.
  double At(const glm::dvec3& p) const {
    const glm::dvec3 q = (p - low_) * per_mm_;
    if (!(q.x >= 0 && q.y >= 0 && q.z >= 0)) return 0.0;
    const int x = static_cast<int>(q.x), y = static_cast<int>(q.y), z = static_cast<int>(q.z);
    if (x >= count_.x || y >= count_.y || z >= count_.z) return 0.0;
    return distance_mm_[(static_cast<size_t>(z) * count_.y + y) * count_.x + x];
  }

 private:
  glm::dvec3 low_{0.0};
  glm::ivec3 count_{0};
  double per_mm_ = 0;
  std::vector<float> distance_mm_;
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

  /// False beyond the outermost surface's bounding box, where no walk should be.
  bool Holds(const glm::dvec3& p) const {
    const glm::dvec3 &a = body_.low, &b = body_.high;
    return p.x >= a.x && p.y >= a.y && p.z >= a.z && p.x <= b.x && p.y <= b.y && p.z <= b.z;
  }
  int layers() const { return layers_; }

 private:
  int MediumOutside(int surface, const glm::dvec3& place, const glm::dvec3& normal) const;
  const LayeredBody& body_;
  int layers_;
  std::vector<const TriangleMesh*> meshes_;
  std::vector<std::vector<glm::dvec3>> normals_;
  RayCaster caster_{{}};
};

}  // namespace crownfit
