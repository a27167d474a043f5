#pragma once
// Dielectric boundaries: smooth, rough with every bounce on the microsurface (so that no energy is lost over the many
// boundary events of one walk), and rough under a smooth film of water.

#include <glm/glm.hpp>
#include <span>

#include "base/random.h"

namespace crownfit {

/// Below this GGX alpha a surface counts as smooth: its lobe is narrower than any lamp.
inline constexpr double kSmoothRoughness = 1e-3;

inline constexpr double kMirror = -1.0;  ///< density of a direction that is not sampled, but certain

/// Direction after scattering. `density` (per steradian) approximates this direction's density by its first bounce. It
/// serves only as a weight of multiple importance sampling.
struct Scattered {
  glm::dvec3 direction;  ///< unit
  double density;        ///< or kMirror
};

/// Density per steradian with which light leaves towards a target outside: an unbiased estimate (0 for mirrors), and
/// the approximation that Scattered::density would hold.
struct TargetDensity {
  double estimate = 0, approximate = 0;
};

/// Smooth boundary (Fresnel, Snell). `normal` may point to either side.
glm::dvec3 ScatterAtSmoothBoundary(const glm::dvec3& direction, const glm::dvec3& normal, double relative_ior,
                                   RandomStream& random);

/// The outer boundary of a crown. Light that arrives from either side is reflected or transmitted; none is lost.
struct OuterBoundary {
  double roughness = 0;  ///< GGX alpha
  double wetness = 0;    ///< share of the area under a smooth film of index kFilmIor
  double inside_ior = 1.5, outside_ior = 1.0;

  bool is_smooth() const { return roughness < kSmoothRoughness; }

  /// `normal`: outward; `targets`: unit vectors from the surface to the outside; each gets one density.
  Scattered Scatter(const glm::dvec3& direction, const glm::dvec3& normal, RandomStream& random,
                    std::span<const glm::dvec3> targets, std::span<TargetDensity> densities) const;

 private:
  Scattered ScatterUnderFilm(const glm::dvec3& direction, const glm::dvec3& normal, RandomStream& random,
                             std::span<const glm::dvec3> targets, std::span<TargetDensity> densities) const;
};

/// A rough boundary alone, in its own frame. `from` points to where the light comes from, from.z > 0; relative_ior is
/// n_below / n_above. The result points up (reflected) or down. Heitz, Hanika, d'Eon and Dachsbacher 2016,
/// "Multiple-scattering microfacet BSDFs with the Smith model", dielectric, with their uniform height distribution.
Scattered ScatterOnMicrosurface(const glm::dvec3& from, double relative_ior, double roughness, RandomStream& random,
                                std::span<const glm::dvec3> targets, std::span<TargetDensity> densities);

}  // namespace crownfit
