#include "path/diffuse_boundary.h"

#include <cmath>

#include "optics/fresnel_moments.h"

namespace crownfit {

PassedMoments PassedBy(const OuterBoundary& b) {
  PassedMoments m;
  const bool is_dense_inside = b.inside_ior >= b.outside_ior;
  if (b.is_smooth() && (is_dense_inside || b.wetness == 0)) {
    // Integrates over the square root of the rare side's cosine, which makes the integrand smooth. The transmittance is
    // the same from both sides.
    const double n = is_dense_inside ? b.inside_ior / b.outside_ior : b.outside_ior / b.inside_ior;
    const WetSurface<double> surface{n, b.wetness, b.outside_ior, b.wetness > 0};
    const Quadrature& q = UnitIntervalQuadrature();
    for (size_t i = 0; i < q.node.size(); ++i) {
      const double root = q.node[i], rare = root * root;
      double passed = 2.0 * q.weight[i] * root * rare * (1.0 - surface.Reflectance(rare)), inside = rare;
      if (is_dense_inside) {
        passed /= n * n;
        inside = std::sqrt(1.0 - (1.0 - rare * rare) / (n * n));
      }
      m.first += passed;
      m.second += passed * inside;
    }
    return m;
  }
  constexpr int kSamples = 1 << 16;
  RandomStream random(0x626f756e64ull);
  for (int i = 0; i < kSamples; ++i) {
    const double cosine = (i + random.Next()) / kSamples;
    const glm::dvec3 direction(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    const bool passes = b.Scatter(direction, {0, 0, 1}, random, {}, {}).direction.z > 0;
    if (!passes) continue;
    m.first += cosine / kSamples;
    m.second += cosine * cosine / kSamples;
  }
  return m;
}

}  // namespace crownfit
