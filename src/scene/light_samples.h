#pragma once
// Points on lamps, as seen from a point: a stratified quadrature of the incident light.

#include <optional>
#include <vector>

#include "capture/light_rig.h"

namespace crownfit {

/// One direction's share of the light: irradiance on a surface of normal n is weight x max(0, n.direction).
struct LightSample {
  glm::dvec3 direction;  ///< unit, towards the light
  double distance_mm;    ///< infinite for directional lights and domes
  Spectrum weight;       ///< per channel, in units of irradiance
};

/// A point on a lamp as seen from a place: sampled at random, or hit by a ray.
struct LightPoint {
  glm::dvec3 direction;  ///< unit, towards the light
  double distance_mm;    ///< infinite for directional lights and domes
  Spectrum radiance;
  double density;  ///< of this direction in SampleLightPoint, per steradian
};

/// Maps two uniform numbers to a point: uniform over the area of disks and rectangles, over the solid angle of the
/// others. Absent where the lamp faces away.
std::optional<LightPoint> SampleLightPoint(const LightShape& light, const glm::dvec3& from, const glm::dvec2& uniform);

/// The point where a ray hits a lamp; the caller checks occlusion. Lamps do not block rays.
std::optional<LightPoint> LightAlong(const LightShape& light, const glm::dvec3& from, const glm::dvec3& direction);

/// `strata` x `strata` samples at the centres of their strata: deterministic and smooth in all arguments. A dome's are
/// cosine-distributed about `normal`. An environment's are its parts, which hold all of its light
/// (EnvironmentMap::FarLamps).
void SampleLight(const LightShape& light, const glm::dvec3& point, const glm::dvec3& normal, int strata,
                 std::vector<LightSample>& out);

/// Samples of a dome or an environment for a glossy surface seen from `view`: half cosine-distributed, half by the
/// visible GGX facets of `roughness`. The balance heuristic (Veach 1995) combines them, so that the weights do not
/// depend on the roughness fitted later. Parts of an environment that are smaller than the lobe are whole samples.
void SampleAllAroundForGloss(const LightShape& light, const glm::dvec3& normal, const glm::dvec3& view,
                             double roughness, int strata, std::vector<LightSample>& out);

}  // namespace crownfit
