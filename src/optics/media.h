#pragma once
// Coefficients of scattering media in the several forms in which they are stated, and what a half space of one returns.

#include <cmath>

namespace crownfit {

/// The scattering coefficient itself, in the unit of the reduced one.
inline double TrueScattering(double reduced, double asymmetry, double isotropic_fraction) {
  return reduced / (1.0 - (1.0 - isotropic_fraction) * asymmetry);
}

/// Fraction of diffuse light that a half space without an index step returns: van de Hulst 1980, spherical albedo, with
/// the similarity-reduced coefficients (within 0.002 for isotropic scattering).
inline double HalfSpaceReflectance(double reduced_scattering, double absorption) {
  if (!(reduced_scattering > 0)) return 0.0;
  const double s = std::sqrt(absorption / (absorption + reduced_scattering));
  return (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s);
}

/// The length over which diffuse light falls off by 1 / e in an absorbing medium, in mm: 1 / sqrt(3 sa (sa + ss')).
/// Infinite without absorption.
inline double DiffuseMeanFreePath_mm(double reduced_scattering_per_mm, double absorption_per_mm) {
  return 1.0 / std::sqrt(3.0 * absorption_per_mm * (absorption_per_mm + reduced_scattering_per_mm));
}

}  // namespace crownfit
