#pragma once
// Nested dielectric layers with opaque things around them, as a random walk meets them.

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/ray_caster.h"
#include "path/triangle_grid.h"
#include "scene/absorption_texture.h"

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
  TriangleGrid grid;
};

/// No distances are compared against a tolerance: a layer's surface counts only if its facing agrees with the medium
/// one is in, so that the facet just left can't be met again; an opaque thing, which may be a sheet with two sides, is
/// met from either, but not on the very triangle one leaves. Facets are flat: refraction uses their own normals.
class WalkScene {
 public:
  /// Both must outlive the scene.
  WalkScene(const LayeredBody& body, const std::vector<TriangleMesh>& opaque);

  /// Which opaque things are there; empty: all.
  using IsThere = std::function<bool(int opaque)>;

  /// First boundary of `medium` along the way, within `max_mm`. `left`: the opaque boundary one comes from, if any.
  std::optional<Boundary> Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm,
                               const Boundary* left = nullptr, const IsThere& is_there = {}) const;

  /// The same by a ray in single precision, inside too: another way to find the same.
  std::optional<Boundary> NextByRay(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm,
                                    const Boundary* left = nullptr, const IsThere& is_there = {}) const;

  /// The boundary that ends a flight inside, of which the body's grid has found the facet.
  Boundary EndOf(const FacetFlight& flight) const;

  /// False beyond the outermost surface's bounding box, where no walk should be.
  bool Holds(const glm::dvec3& p) const {
    const glm::dvec3 &a = body_.low, &b = body_.high;
    return p.x >= a.x && p.y >= a.y && p.z >= a.z && p.x <= b.x && p.y <= b.y && p.z <= b.z;
  }
  int layers() const { return layers_; }

 private:
  bool Counts(int mesh, int triangle, const glm::dvec3& direction, int medium, const Boundary* left,
              const IsThere& is_there) const;
  Boundary BoundaryAt(int mesh, int triangle, double distance_mm, const glm::dvec3& position, const glm::dvec3& normal,
                      int medium) const;
  int MediumOutside(int surface, const glm::dvec3& place, const glm::dvec3& normal) const;
  const LayeredBody& body_;
  int layers_;
  std::vector<const TriangleMesh*> meshes_;
  std::vector<std::vector<glm::dvec3>> normals_;
  RayCaster caster_{{}};
};

}  // namespace crownfit
