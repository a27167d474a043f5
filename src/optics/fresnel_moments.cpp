#include "optics/fresnel_moments.h"

#include <cmath>
#include <numbers>

namespace crownfit {

const GaussLegendre& UnitIntervalQuadrature() {
  static const GaussLegendre quadrature = [] {
    constexpr int n = GaussLegendre::kNodes;
    GaussLegendre q{};
    for (int i = 0; i < n; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (n + 0.5)), slope = 1;
      for (int step = 0; step < 100; ++step) {
        double p0 = 1, p1 = x;
        for (int k = 2; k <= n; ++k) {
          const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
          p0 = p1;
          p1 = p2;
        }
        slope = n * (x * p1 - p0) / (x * x - 1);
        const double change = p1 / slope;
        x -= change;
        if (std::abs(change) < 1e-16) break;
      }
      q.x[i] = 0.5 * (1 - x);
      q.weight[i] = 1.0 / ((1 - x * x) * slope * slope);
    }
    return q;
  }();
  return quadrature;
}

}  // namespace crownfit
