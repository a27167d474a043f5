#pragma once
// Integrals of the Fresnel reflectance over the hemisphere, by quadrature in the rare side's cosine, where the
// integrand has no kink. theory: Fdr_int = 1 - (1 - Fdr_ext) / n^2 is exact (etendue).

#include "optics/quadrature.h"
#include "optics/shading_terms.h"

namespace crownfit {

/// 32 Gauss-Legendre nodes on [0, 1], computed once.
const Quadrature& UnitIntervalQuadrature();

template <class T>
struct FresnelMoments {
  T diffuse_outside;  ///< 2 int F mu dmu for light from the rare side
  T diffuse_inside;   ///< the same for light from the dense side, total reflection included
  T boundary_A;       ///< (1 + diffuse_inside) / (1 - diffuse_inside): see docs/decisions/0002-boundary-condition.md
};

/// relative_ior = n_inside / n_outside >= 1.
template <class T>
FresnelMoments<T> MomentsOf(const T& relative_ior) {
  const auto& q = UnitIntervalQuadrature();
  T outside(0.0);
  for (size_t i = 0; i < q.node.size(); ++i)
    outside += 2.0 * q.weight[i] * q.node[i] * Terms<T>::FresnelReflectance(T(q.node[i]), relative_ior);
  FresnelMoments<T> m;
  m.diffuse_outside = outside;
  m.diffuse_inside = 1.0 - (1.0 - outside) / (relative_ior * relative_ior);
  m.boundary_A = (1.0 + m.diffuse_inside) / (1.0 - m.diffuse_inside);
  return m;
}

}  // namespace crownfit
