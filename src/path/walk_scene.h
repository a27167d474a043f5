#pragma once
// Nested dielectric layers with opaque objects around them, as a random walk meets them.

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
  int opaque = -1;      ///< index of the opaque object that was met; -1: a layer's surface
  int triangle = -1;
  bool is_cut = false;  ///< closes the neck of an open scan
  int behind(int medium) const { return medium == inside ? outside : inside; }
  /// The medium that light enters.
  int towards(const glm::dvec3& direction) const { return glm::dot(direction, normal) < 0 ? inside : outside; }
};

/// The layers of an object: closed surfaces, outermost first. A point belongs to the innermost layer that holds it, and
/// the object is the union of all: dentine may protrude from the enamel as a root.
struct LayeredBody {
  /// `textures`: per layer, or none at all.
  LayeredBody(std::vector<TriangleMesh> layer_surfaces, int threads,
              std::vector<std::shared_ptr<const AbsorptionTexture>> textures = {});
  std::vector<TriangleMesh> surfaces;
  std::vector<std::shared_ptr<const AbsorptionTexture>> absorption;  ///< per layer, where it varies
  /// Per surface and triangle: the medium outside may be another than the layer above. Empty for the outermost surface.
  std::vector<std::vector<uint8_t>> is_exposed;
  glm::dvec3 low, high;  ///< bounding box, enlarged by the rounding of single-precision rays
  TriangleGrid grid;
};

/// No distance is compared with a tolerance. A layer's surface counts only if its facing agrees with the current
/// medium, so the facet just left can't be met again. An opaque object may be a two-sided sheet: it is met from either
/// side, but not on the triangle just left. Facets are flat: refraction uses their own normals.
class WalkScene {
 public:
  /// Both must outlive the scene.
  WalkScene(const LayeredBody& body, const std::vector<TriangleMesh>& opaque);

  /// Selects the opaque objects that are present; empty: all.
  using IsThere = std::function<bool(int opaque)>;

  /// First boundary of `medium` along the ray, within `max_mm`. `left`: the opaque boundary just left, if any.
  std::optional<Boundary> Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm,
                               const Boundary* left = nullptr, const IsThere& is_there = {}) const;

  /// The same by a single-precision ray, inside too: an independent way to find it.
  std::optional<Boundary> NextByRay(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm,
                                    const Boundary* left = nullptr, const IsThere& is_there = {}) const;

  /// The boundary that ends a flight inside, from the facet that the body's grid found.
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
