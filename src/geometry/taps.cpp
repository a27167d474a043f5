#include "geometry/taps.h"

#include <cmath>
#include <numbers>

#include "geometry/crown.h"

namespace crownfit {
namespace {

constexpr double kLift_mm = 2e-3;  // rays start this far below the surface

glm::dvec3 TapPlace(const glm::dvec3& position, const glm::dvec3& normal, const TapKernel::Offset& offset) {
  const auto [u, v] = Tangents(normal);
  return position + offset.mm.x * u + offset.mm.y * v;
}

/// True on the far side of the cut where an open scan ends.
bool IsBelowNeck(const Crown& crown, const glm::dvec3& place) {
  if (crown.cut.triangles.empty()) return false;
  const SurfacePoint nearest = crown.cut_caster.ClosestPoint(place);
  return glm::dot(place - Position(crown.cut, nearest), FaceNormal(crown.cut, nearest.triangle)) > 0;
}

/// `depth_mm`: straight through the object; `layers_mm`: of the flat layers that stand for it (Column).
Tap CastTap(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal, double depth_mm, double layers_mm,
            const TapKernel::Offset& offset) {
  Tap tap{offset.ring, {}, {}, false};
  const glm::dvec3 place = TapPlace(position, normal, offset);
  const glm::dvec3 below = position - std::max(kLift_mm, std::min(glm::length(offset.mm), 0.5 * depth_mm)) * normal;
  if (const auto hit = crown.fine_caster.Nearest(below, glm::normalize(place - below)))
    tap.front = InterpolationAt(crown.fine, hit->point);
  const glm::dvec3 start = position - kLift_mm * normal, opposite = place - std::max(layers_mm, kLift_mm) * normal;
  if (const auto out = crown.fine_caster.Nearest(start, glm::normalize(opposite - position)))
    tap.opposite = InterpolationAt(crown.fine, out->point);
  return tap;
}

}  // namespace

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

std::vector<Tap> CastTaps(const Crown& crown, const TapKernel& kernel, const glm::dvec3& position,
                          const glm::dvec3& normal, double layers_mm, bool tooth_goes_on) {
  std::vector<Tap> taps;
  const auto through = crown.fine_caster.Nearest(position - kLift_mm * normal, -normal);
  const double depth = through ? through->distance_mm : 0.0;
  for (const auto& offset : kernel.offsets) {
    Tap tap = CastTap(crown, position, normal, depth, layers_mm, offset);
    if (tooth_goes_on && !taps.empty() && IsBelowNeck(crown, TapPlace(position, normal, offset)))
      tap = {offset.ring, taps.front().front, taps.front().opposite, true};
    if (tap.front.exists()) taps.push_back(tap);
  }
  return taps;
}

}  // namespace crownfit
