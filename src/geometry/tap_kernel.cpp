#include <cmath>
#include <numbers>

#include "geometry/cast_samples.h"

namespace crownfit {

TapKernel ConvergedKernel() {
  TapKernel kernel;
  kernel.offsets.push_back({glm::dvec2(0.0), 0});
  double radius_mm = 0.15;
  kernel.outer_radius_mm.push_back(radius_mm / std::numbers::sqrt2);
  for (int ring = 1; ring <= 6; ++ring, radius_mm *= 2.0) {
    for (int k = 0; k < 8; ++k) {
      const double angle = 2 * std::numbers::pi * (k + 0.5 * (ring % 2)) / 8;
      kernel.offsets.push_back({radius_mm * glm::dvec2(std::cos(angle), std::sin(angle)), ring});
    }
    if (ring < 6) kernel.outer_radius_mm.push_back(radius_mm * std::numbers::sqrt2);
  }
  return kernel;
}

}  // namespace crownfit
