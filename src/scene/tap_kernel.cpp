#include "scene/tap_kernel.h"

#include <cmath>
#include <numbers>

namespace crownfit {

std::vector<int> TapsPerRing(const TapKernel& kernel) {
  std::vector<int> count(kernel.rings(), 0);
  for (const auto& offset : kernel.offsets) ++count[offset.ring];
  return count;
}

TapKernel ConvergedKernel() {
  TapKernel kernel;
  kernel.offsets.push_back({glm::dvec2(0.0), 0});
  double radius_mm = 0.15;
  kernel.outer_radius_mm.push_back(radius_mm / std::numbers::sqrt2);
  for (int ring = 1; ring <= 6; ++ring, radius_mm *= 2.0) {
    for (int k = 0; k < 8; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / 8;
      kernel.offsets.push_back({radius_mm * glm::dvec2(std::cos(angle), std::sin(angle)), ring});
    }
    if (ring < 6) kernel.outer_radius_mm.push_back(radius_mm * std::numbers::sqrt2);
  }
  return kernel;
}

Interpolation InterpolationAt(const TriangleMesh& mesh, const SurfacePoint& p) {
  Interpolation at;
  if (p.triangle < 0) return at;
  for (int k = 0; k < 3; ++k) {
    at.vertices[k] = mesh.triangles[p.triangle][k];
    at.weights[k] = static_cast<float>(p.weights[k]);
  }
  return at;
}

}  // namespace crownfit
