#include "dental/translucency.h"

#include <cmath>

#include "photo/colour.h"

namespace crownfit {

Translucency TranslucencyOf(const glm::dvec3& over_black, const glm::dvec3& over_white) {
  const glm::dvec3 black = LabFromLinearRgb(over_black), white = LabFromLinearRgb(over_white);
  return {Ciede2000(black, white), glm::length(black - white), LuminanceOf(over_black) / LuminanceOf(over_white)};
}

KubelkaMunk KubelkaMunkFromCards(double over_black, double over_white, double black, double white,
                                 double thickness_mm) {
  // R = R0 + T^2 Rg / (1 - R0 Rg) for either card: without T^2, the terms in R0^2 of the two equations cancel. Then
  // a = (1 + R0^2 - T^2) / (2 R0), b S X = artanh(b R0 / (1 - a R0)).
  const double r0 = (white * over_black - black * over_white) /
                    (white * (1.0 + black * over_black) - black * (1.0 + white * over_white)),
               t2 = (over_white - r0) * (1.0 - r0 * white) / white;
  const double a = (1.0 + r0 * r0 - t2) / (2.0 * r0), b = std::sqrt(std::max(0.0, a * a - 1.0));
  // Without absorption b is 0: S X = R0 / (1 - R0).
  const double sx = b > 1e-6 ? std::atanh(b * r0 / (1.0 - a * r0)) / b : r0 / (1.0 - r0);
  const double s = t2 > 1e-9 ? sx / thickness_mm : NAN;
  return {s * (a - 1.0), s};
}

}  // namespace crownfit
