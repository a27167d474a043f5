#include "scene/long_axis.h"

#include <algorithm>
#include <limits>

#include "capture/capture.h"

namespace crownfit {
namespace {

/// Away from the neck, when the scan is open there.
std::optional<glm::dvec3> AxisFromNeck(const TriangleMesh& outer) {
  glm::dvec3 out(0.0);
  const TriangleMesh cut = CutPart(outer);
  for (const auto& t : cut.triangles)
    out += glm::cross(cut.vertices[t.y] - cut.vertices[t.x], cut.vertices[t.z] - cut.vertices[t.x]);
  if (glm::length(out) == 0) return std::nullopt;
  return -glm::normalize(out);
}

}  // namespace

std::optional<LongAxis> LongAxisOf(const Capture& capture, const TriangleMesh& outer) {
  const auto direction = capture.long_axis ? capture.long_axis : AxisFromNeck(outer);
  if (!direction) return std::nullopt;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  LongAxis axis{*direction, kInfinite, -kInfinite};
  for (const auto& v : outer.vertices) {
    axis.low_mm = std::min(axis.low_mm, glm::dot(v, axis.direction));
    axis.high_mm = std::max(axis.high_mm, glm::dot(v, axis.direction));
  }
  return axis;
}

}  // namespace crownfit
