#pragma once
// Integrals of the Fresnel reflectance over the hemisphere, by quadrature in the rare side's cosine, where the
// integrand has no kink. theory: Fdr_int = 1 - (1 - Fdr_ext) / n^2 is exact (etendue).

#include <array>

#include "optics/shading_terms.h"

namespace crownfit {

struct GaussLegendre {
  static constexpr int kNodes = 32;
  std::array<double, kNodes> x, weight;  ///< on [0, 1]
};

/// Nodes and weights, computed once by Newton's method on the Legendre polynomial.
const GaussLegendre& UnitIntervalQuadrature();

template <class T>
struct FresnelMoments {
  T diffuse_outside;  ///< 2 int F mu dmu for light from the rare side
  T diffuse_inside;   ///< the same for light from the dense side, total reflection included
  T boundary_A;       ///< (1 + 3 C2) / (1 - 2 C1), ratio of flux and fluence moments (Aronson 1995; Contini 1997)
};

/// relative_ior = n_inside / n_outside >= 1.
template <class T>
FresnelMoments<T> MomentsOf(const T& relative_ior) {
  using std::sqrt;
  const auto& q = UnitIntervalQuadrature();
  const T n2 = relative_ior * relative_ior;
  T outside(0.0), second(0.0);
  for (int i = 0; i < GaussLegendre::kNodes; ++i) {
    const T f = Terms<T>::FresnelReflectance(T(q.x[i]), relative_ior);
    outside += 2.0 * q.weight[i] * q.x[i] * f;
    second += q.weight[i] * q.x[i] * f * sqrt(1.0 - (1.0 - q.x[i] * q.x[i]) / n2) / n2;
  }
  const T critical = Terms<T>::max(1.0 - 1.0 / n2, T(1e-15));  // squared cosine of the critical angle
  const T c2 = critical * sqrt(critical) / 3.0 + second;
  FresnelMoments<T> m;
  m.diffuse_outside = outside;
  m.diffuse_inside = 1.0 - (1.0 - outside) / n2;
  m.boundary_A = (1.0 + 3.0 * c2) / (1.0 - m.diffuse_inside);
  return m;
}

}  // namespace crownfit
