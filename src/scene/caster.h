#pragma once
// One photograph's scene for ray casts: what blocks light and what reflects it.

#include <optional>
#include <span>
#include <vector>

#include "capture/capture.h"
#include "scene/cast_samples.h"
#include "scene/light_samples.h"
#include "scene/tile_view.h"

namespace crownfit {

/// A light in the object's frame.
struct PhotographLight {
  int index;  ///< in the capture
  LightShape shape;
  double intensity;  ///< as the capture states it
};

/// One photograph's scene: what blocks light and what reflects it.
class Caster {
 public:
  Caster(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery, size_t photograph,
         const CastOptions& options);

  /// Light that arrives at a place, per light. `visibility`: the unoccluded fraction of each.
  void Gather(const glm::dvec3& position, const glm::dvec3& normal, int lamp_strata, LightShares& shares,
              float* visibility = nullptr) const;

  /// Directions in which a rough surface reflects the lamps, each lamp scaled by its `visibility`.
  void AddHighlights(const glm::dvec3& position, const glm::dvec3& normal, const glm::dvec3& view,
                     std::span<const float> visibility, Highlights& highlights) const;

  /// Light that reaches a place via scenery and backings (one bounce), and the fraction of its sky that the backing
  /// fills.
  BackingShare GatherScenery(const glm::dvec3& position, const glm::dvec3& normal, LightShares& shares) const;

  /// Radiance of a Lambertian object seen along `direction`, one entry per light: rho E / pi, direct light only.
  std::vector<Spectrum> SceneryRadiance(const Hit& hit, const glm::dvec3& direction, int lamp_strata) const;

  /// Scenery and tile, in triangles small enough that their vertices show the shadows.
  std::vector<ShadedMesh> ShadedScenery() const;

  /// Scenery as a pixel shows it.
  Spectrum SceneryShown(const Hit& hit, const glm::dvec3& direction) const;

  /// Adds the radiance of every lamp in a mirror at `position`, as seen along the camera ray `direction`, times
  /// `share`.
  void Mirror(const glm::dvec3& position, const glm::dvec3& normal, const glm::dvec3& direction, double share,
              std::vector<Mirrored>& mirrored) const;

  glm::dvec3 PixelDirection(double x, double y) const;
  std::optional<Hit> Seen(const glm::dvec3& direction) const { return caster_.Nearest(camera_, direction); }
  int strata() const { return options_.strata; }
  size_t lights() const { return lights_.size(); }

 private:
  std::vector<Spectrum> Radiance(int mesh, const glm::dvec3& place, const glm::dvec3& normal, int lamp_strata) const;

  /// Tabulated because the tile's radiance varies little over a cell and thousands of places on the crown see it.
  void TabulateTile(const BackingSpec& spec, const Crown& crown);

  /// pi x radiance of a matte object at exposure 1, in the lights as the capture states them: direct light only.
  Spectrum Shown(size_t mesh, const glm::dvec3& place, const glm::dvec3& normal, int lamp_strata) const;

  ShadedMesh Shaded(size_t mesh) const;

  /// Faces the object, whichever way its normal is stated.
  static TriangleMesh BackingTile(const BackingSpec& b, const Crown& crown);

  const PhotographSpec& photo_;
  const CastOptions& options_;
  TriangleMesh tile_;
  std::optional<TileGrid> tile_grid_;
  glm::dvec3 tile_normal_;               ///< towards the object
  std::vector<double> object_seen_;      ///< per place of the tile's grid
  std::vector<Spectrum> tile_radiance_;  ///< per place and light
  glm::dvec3 camera_;
  std::vector<PhotographLight> lights_;
  std::vector<const TriangleMesh*> meshes_;
  std::vector<Spectrum> reflectance_;
  RayCaster caster_;
};

}  // namespace crownfit
