#pragma once
// Edge loss: an instrument lights and sees a sample through one round aperture, and light that has gone sideways inside
// comes up outside it.

#include <vector>

#include "optics/slab.h"

namespace crownfit {

/// The reading is the mean of what waves of light on the surface return, weighted by the aperture's own spectrum,
/// (2 J1(ka) / (ka))^2. Weights add up to 1.
struct ApertureWave {
  double wave_number_per_mm, weight;
};
std::vector<ApertureWave> ApertureWaves(double diameter_mm);

/// The slab as a wave of light on its surface finds it: going sideways counts as absorption. In an infinite medium of
/// isotropic scattering s the share of a wave's light that a flight keeps is A = atan(k / (s + a)) / k (Case and
/// Zweifel 1967), as though absorption were 1 / A - s; a + k^2 / (3 (s + a)), diffusion's own, where k is small.
/// Approximate near the surface and for forward scattering, where the reduced coefficient stands for s.
Slab UnderWave(Slab slab, double wave_number_per_mm);

/// Share of the modelled edge loss by which it may be wrong, one standard deviation: against walks the model loses 2 to
/// 6 % too much (docs/dental.md).
inline constexpr double kEdgeLossError = 0.05;

}  // namespace crownfit
