#pragma once
// The axis from cervical to incisal.

#include <optional>

#include "geometry/triangle_mesh.h"

namespace crownfit {

struct Capture;

/// From the neck to the incisal edge.
struct LongAxis {
  glm::dvec3 direction;    ///< unit
  double low_mm, high_mm;  ///< extent of the crown along it
  /// 0 at the neck, 1 at the edge.
  double At(const glm::dvec3& p) const { return (glm::dot(p, direction) - low_mm) / (high_mm - low_mm); }
};

/// The axis that the capture states, or away from the neck of an open scan. Absent where the mesh is closed and none is
/// stated.
std::optional<LongAxis> LongAxisOf(const Capture& capture, const TriangleMesh& outer);

}  // namespace crownfit
