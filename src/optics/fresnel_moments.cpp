#include "optics/fresnel_moments.h"

namespace crownfit {

const Quadrature& UnitIntervalQuadrature() {
  static const Quadrature quadrature = GaussLegendre(32, 0.0, 1.0);
  return quadrature;
}

}  // namespace crownfit
