#include "shader/twelve_taps.h"

#include "optics/shading_terms.h"

namespace crownfit {

TapKernel TwelveTapKernel() {
  static constexpr int kRing[13] = {0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 3, 3, 3};
  constexpr double kScale_mm = 0.45;  // the outer taps are then 1.9 to 2.9 mm away, where a dentine's profile ends
  TapKernel kernel;
  for (int i = 0; i < 13; ++i)
    kernel.offsets.push_back(
        {kScale_mm * glm::dvec2(Terms<double>::HableTapX(i), Terms<double>::HableTapY(i)), kRing[i]});
  // Ring borders: half the first ring's radius, then geometric means of neighbouring rings' mean radii.
  kernel.outer_radius_mm = {kScale_mm * 0.1, kScale_mm * 0.59, kScale_mm * 2.9};
  return kernel;
}

}  // namespace crownfit
