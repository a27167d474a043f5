#pragma once
// Participating media: attenuation between collisions, scattering at collisions.

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <numbers>

#include "base/random.h"
#include "geometry/triangle_mesh.h"
#include "scene/absorption_texture.h"

namespace crownfit {

/// Scattering and absorption per channel, 1/mm. True scattering, not the reduced one.
struct Medium {
  double ior = 1.0, g = 0.0, isotropic_fraction = 0.0;
  Spectrum scattering{}, absorption{};
  const AbsorptionTexture* texture = nullptr;  ///< a factor on absorption; none: homogeneous
  /// Reduced scattering over scattering.
  double similarity() const { return 1.0 - (1.0 - isotropic_fraction) * g; }
  /// d ln(scattering) / dg at constant reduced scattering.
  double ScatteringByAsymmetry() const { return (1.0 - isotropic_fraction) / similarity(); }
};

/// Unit vector at angle acos(`cosine`) to `axis`, turned by `angle` about it.
inline glm::dvec3 About(const glm::dvec3& axis, double cosine, double angle) {
  const auto [u, v] = Tangents(axis);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return sine * std::cos(angle) * u + sine * std::sin(angle) * v + cosine * axis;
}

/// Cosine-distributed about `normal` (Lambert).
inline glm::dvec3 SampleLambert(const glm::dvec3& normal, RandomStream& random) {
  const double cosine = std::sqrt(random.Next());
  return About(normal, cosine, 2.0 * std::numbers::pi * random.Next());
}

/// Direction after a collision: Henyey and Greenstein 1941, mixed with a share of isotropic scattering. Near g = 0 the
/// exact inversion loses digits, so its first-order expansion in g is used.
inline glm::dvec3 SamplePhaseFunction(const Medium& m, const glm::dvec3& direction, RandomStream& random) {
  double cosine;
  const double u = random.Next();
  const bool isotropic = m.isotropic_fraction > 0 && random.Next() < m.isotropic_fraction;
  if (isotropic || std::abs(m.g) < 1e-3) {
    const double c = 2.0 * u - 1.0;
    cosine = isotropic ? c : c + 1.5 * m.g * (1.0 - c * c);
  } else {
    const double s = (1.0 - m.g * m.g) / (1.0 - m.g + 2.0 * m.g * u);
    cosine = std::clamp((1.0 + m.g * m.g - s * s) / (2.0 * m.g), -1.0, 1.0);
  }
  return glm::normalize(About(direction, cosine, 2.0 * std::numbers::pi * random.Next()));
}

}  // namespace crownfit
