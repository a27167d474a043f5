#include "scene/taps.h"

#include <cmath>
#include <numbers>

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

/// `depth_mm`: straight through the object; `layers_mm`: of the flat layers that represent it (Column).
Tap CastTap(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal, double depth_mm, double layers_mm,
            const TapKernel::Offset& offset) {
  Tap tap{offset.ring, {}, {}, false};
  const glm::dvec3 place = TapPlace(position, normal, offset);
  const glm::dvec3 below = position - std::max(kLift_mm, std::min(glm::length(offset.mm), 0.5 * depth_mm)) * normal;
  if (const auto hit = WayOut(crown, below, glm::normalize(place - below)))
    tap.front = InterpolationAt(crown.fine, hit->point);
  const glm::dvec3 start = position - kLift_mm * normal, opposite = place - std::max(layers_mm, kLift_mm) * normal;
  if (const auto out = WayOut(crown, start, glm::normalize(opposite - position)))
    tap.opposite = InterpolationAt(crown.fine, out->point);
  return tap;
}

}  // namespace

std::optional<Hit> WayOut(const Crown& crown, const glm::dvec3& start, const glm::dvec3& direction) {
  const auto leads_out = [&](int, int triangle) { return glm::dot(FaceNormal(crown.fine, triangle), direction) >= 0; };
  const auto hit = crown.fine_caster.Nearest(start, direction);
  if (!hit || leads_out(0, hit->point.triangle)) return hit;
  return crown.fine_caster.NearestAccepted(start, direction, kFar, leads_out);
}

std::vector<Tap> CastTaps(const Crown& crown, const TapKernel& kernel, const glm::dvec3& position,
                          const glm::dvec3& normal, double layers_mm, bool tooth_goes_on) {
  std::vector<Tap> taps;
  const auto through = WayOut(crown, position - kLift_mm * normal, -normal);
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
