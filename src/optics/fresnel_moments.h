#pragma once
// Integrals of the Fresnel reflectance over the hemisphere, by quadrature in the root of the rare side's cosine. There
// the integrand has no kink, and nodes resolve small index steps, which reflect at grazing incidence alone. Within 1e-9
// of exact for any index. theory: Fdr_int = 1 - (1 - Fdr_ext) / n^2 is exact (etendue).

#include <type_traits>

#include "optics/quadrature.h"
#include "optics/shading_terms.h"

namespace crownfit {

/// 32 Gauss-Legendre nodes on [0, 1], computed once.
const Quadrature& UnitIntervalQuadrature();

/// Indices that differ by no larger fraction count as equal: the step between them would reflect 2e-9 of diffuse light,
/// and deflect the rest by 1e-9 times the tangent of its angle of incidence.
inline constexpr double kSameIndex = 1e-9;

inline constexpr double kFilmIor = 1.333;  ///< water; saliva is within 0.002 of it

/// The surface seen from outside: an index step, under a film of water over a fraction of the area.
template <class T>
struct WetSurface {
  T relative_ior;  ///< n_inside / n_outside >= 1
  T wetness = T(0.0);
  double outside_ior = 1.0;
  bool may_be_wet = false;  ///< false: wetness and its derivative are taken as 0, at half the cost

  T Reflectance(const T& cosine) const {
    if constexpr (!std::is_same_v<T, double>)  // skips derivatives that are all 0: a tenth of the work
      if (!HasDerivative(relative_ior) && !HasDerivative(wetness) && !HasDerivative(cosine))
        return T(WetSurface<double>{PlainValue(relative_ior), PlainValue(wetness), outside_ior, may_be_wet}.Reflectance(
            PlainValue(cosine)));
    return may_be_wet ? Terms<T>::WetReflectance(cosine, relative_ior, film_ior(), wetness)
                      : Terms<T>::FresnelReflectance(cosine, relative_ior);
  }
  T film_ior() const { return T(kFilmIor / outside_ior); }
};

template <class T>
struct FresnelMoments {
  T diffuse_outside;  ///< 2 int F mu dmu for light from the rare side
  T diffuse_inside;   ///< the same for light from the dense side, total reflection included
  T boundary_A;       ///< (1 + diffuse_inside) / (1 - diffuse_inside): see docs/decisions/0002-boundary-condition.md
};

template <class T>
FresnelMoments<T> MomentsOf(const WetSurface<T>& surface) {
  const auto& q = UnitIntervalQuadrature();
  T outside(0.0);
  for (size_t i = 0; i < q.node.size(); ++i) {
    const double root = q.node[i], cosine = root * root;
    outside += 4.0 * q.weight[i] * root * cosine * surface.Reflectance(T(cosine));
  }
  FresnelMoments<T> m;
  m.diffuse_outside = outside;
  m.diffuse_inside = 1.0 - (1.0 - outside) / (surface.relative_ior * surface.relative_ior);
  m.boundary_A = (1.0 + m.diffuse_inside) / (1.0 - m.diffuse_inside);
  return m;
}

/// Of a dry surface; relative_ior = n_inside / n_outside >= 1.
template <class T>
FresnelMoments<T> MomentsOf(const T& relative_ior) {
  return MomentsOf(WetSurface<T>{relative_ior});
}

}  // namespace crownfit
