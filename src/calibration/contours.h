#pragma once
// Where a camera sees the outline of a mesh and the lines between its parts.

#include <glm/glm.hpp>
#include <vector>

#include "capture/camera.h"
#include "capture/rigid_transform.h"
#include "geometry/ray_caster.h"

namespace crownfit {

/// A place where the object's outline, or the line between two of its parts, is seen.
struct ContourPoint {
  glm::dvec3 on_object_mm;
  glm::dvec2 pixel, outward;  ///< unit, from the nearer part to what lies behind it
  bool is_outer;              ///< nothing of the object behind it
};

/// Contours of a mesh as a camera sees it; `parts`: connected part of every triangle. Found on a grid of `step_px` and
/// bisected to a sixteenth of it.
std::vector<ContourPoint> Contours(const RayCaster& caster, const std::vector<int>& parts, const Camera& camera,
                                   const RigidTransform& camera_from_object, int step_px);

/// Connected part of every triangle.
std::vector<int> ConnectedParts(const TriangleMesh& mesh);

}  // namespace crownfit
