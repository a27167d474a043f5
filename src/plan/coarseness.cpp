#include "plan/coarseness.h"

#include <algorithm>

#include "geometry/ray_caster.h"

namespace crownfit {
namespace {

/// Usable pixels whose centres and corners show the object.
size_t ObjectPixels(const PhotographSpec& spec, const Photograph& photo, const RayCaster& caster) {
  const RigidTransform object_from_camera = spec.camera_from_object.Inverse();
  const auto shows = [&](double x, double y) {
    const glm::dvec3 direction = object_from_camera.Direction(DirectionFromPixel(spec.camera, {x, y}));
    return caster.Nearest(object_from_camera.translation_mm, direction).has_value();
  };
  size_t count = 0;
  for (int y = 0; y < spec.camera.height; ++y)
    for (int x = 0; x < spec.camera.width; ++x)
      count += photo.usable[static_cast<size_t>(y) * spec.camera.width + x] && shows(x + 0.5, y + 0.5) && shows(x, y) &&
               shows(x + 1.0, y) && shows(x, y + 1.0) && shows(x + 1.0, y + 1.0);
  return count;
}

}  // namespace

Coarseness Coarsen(CrownInput& input) {
  // Of all photographs together, and of each at least: pixels of the object, and triangles on which light is gathered.
  constexpr double kPixels = 60000, kTriangles = 240000, kFewestPixels = 300, kFewestTriangles = 1500;
  constexpr double kLeastUsable = 0.5;
  const double photographs = static_cast<double>(input.photographs.size());
  Coarseness coarse;
  coarse.cast.strata = coarse.cast.gather_strata = 3;
  coarse.cast.crown.simplifies = true;
  size_t& triangles = coarse.cast.crown.fine_triangles;
  triangles = std::min(triangles, static_cast<size_t>(std::max(kFewestTriangles, kTriangles / photographs)));
  const double most_pixels = std::max(kFewestPixels, kPixels / photographs);
  const TriangleMesh& outer = *input.source.meshes[0];
  const RayCaster caster({&outer});
  for (size_t i = 0; i < input.photographs.size(); ++i) {
    PhotographSpec spec = input.capture.photographs[i];
    Photograph photo = input.photographs[i];
    int side = AverageCrown(outer, most_pixels, /*noise_is_known=*/true, spec, photo, kLeastUsable);
    // A thin object or a small mask would vanish.
    if (side > 1 && static_cast<double>(ObjectPixels(spec, photo, caster)) < 0.25 * kFewestPixels) side = 1;
    if (side > 1) {
      input.capture.photographs[i] = std::move(spec);
      input.photographs[i] = std::move(photo);
    }
    coarse.merged.push_back(static_cast<double>(side) * side);
  }
  return coarse;
}

}  // namespace crownfit
