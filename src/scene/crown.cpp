#include "scene/crown.h"

namespace crownfit {

glm::dvec3 ShadingNormal(const Crown& crown, const SurfacePoint& p) {
  const auto& n = crown.fine_corner_normals[p.triangle];
  return glm::normalize(p.weights.x * n[0] + p.weights.y * n[1] + p.weights.z * n[2]);
}

}  // namespace crownfit
