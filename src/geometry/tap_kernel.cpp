#include <cmath>
#include <numbers>

#include "geometry/cast_samples.h"

namespace crownfit {

TapKernel TwelveTapKernel() {
  // Offsets in units of the kernel's scale: Hable's 1 + 12 taps ("Fast Skin Shading", ShaderX7 2009), without weights.
  static constexpr double kOffsets[13][2] = {{0.0, 0.0},
                                             {-0.194906, 0.091094},
                                             {-0.239737, -0.220217},
                                             {-0.003530, -0.118219},
                                             {1.633992, 0.036795},
                                             {0.177801, 1.717592},
                                             {1.320107, -0.181542},
                                             {5.970690, 0.253378},
                                             {-1.089250, 4.958349},
                                             {-4.015465, 4.156699},
                                             {-4.063099, -4.110150},
                                             {-0.638605, -6.297663},
                                             {2.542348, -3.245901}};
  static constexpr int kRing[13] = {0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3};
  constexpr double kScale_mm = 0.45;  // the outer taps then lie 1.9 to 2.9 mm away, where a dentine's profile ends
  TapKernel kernel;
  for (int i = 0; i < 13; ++i)
    kernel.offsets.push_back({kScale_mm * glm::dvec2(kOffsets[i][0], kOffsets[i][1]), kRing[i]});
  // Ring borders: half way to the first ring, then geometric means of neighbouring rings' mean radii.
  kernel.outer_radius_mm = {kScale_mm * 0.1, kScale_mm * 0.59, kScale_mm * 2.9};
  return kernel;
}

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
