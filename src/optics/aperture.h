#pragma once
// Edge loss: an instrument lights and sees a sample through one round aperture, and light that travels sideways inside
// emerges outside it.

#include <vector>

#include "optics/slab.h"

namespace crownfit {

/// The reading is the mean response to waves of illumination on the surface, weighted by the aperture's own spectrum,
/// (2 J1(ka) / (ka))^2. Weights add up to 1.
struct ApertureWave {
  double wave_number_per_mm, weight;
};
std::vector<ApertureWave> ApertureWaves(double diameter_mm);

/// The slab for a wave of illumination on its surface: lateral transport counts as absorption. In an infinite medium of
/// isotropic scattering s, one flight keeps the fraction A = atan(k / (s + a)) / k of a wave's light (Case and Zweifel
/// 1967), as though absorption were 1 / A - s. For small k this is diffusion's a + k^2 / (3 (s + a)). Approximate near
/// the surface and for forward scattering, where the reduced coefficient replaces s.
Slab UnderWave(Slab slab, double wave_number_per_mm);

/// Relative standard deviation of the modelled edge loss: compared with path tracing, the model loses 2 to 6 % too much
/// (docs/dental.md).
inline constexpr double kEdgeLossError = 0.05;

}  // namespace crownfit
