#pragma once
// The outer boundary for diffuse light inside.

#include "path/boundary.h"

namespace crownfit {

/// int T(mu) mu dmu and int T(mu) mu^2 dmu over the directions that come from inside; T: transmittance.
struct PassedMoments {
  double first = 0, second = 0;
  /// J = n^2 psi / (2 A), over psi = fluence / n^2: the moment form (docs/decisions/0008-boundary-of-the-volume.md).
  double Leak(double index2) const { return index2 * first / (2.0 - 3.0 * second); }
};

/// By quadrature where the boundary is smooth, else by 65536 stratified samples (0.3 %).
PassedMoments PassedBy(const OuterBoundary& boundary);

}  // namespace crownfit
