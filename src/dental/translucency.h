#pragma once
// Dental measures of a translucent sample over a black and a white card.

#include <glm/glm.hpp>

namespace crownfit {

struct Translucency {
  double tp00;   ///< translucency parameter (Johnston, Ma and Kienle 1995), here with CIEDE2000 between the two
  double tp_ab;  ///< the same with the CIELAB distance
  double contrast_ratio;  ///< luminance over black / over white: 0 clear, 1 opaque
};
/// From linear sRGB over black and over white.
Translucency TranslucencyOf(const glm::dvec3& over_black, const glm::dvec3& over_white);

struct KubelkaMunk {
  double absorption_per_mm, scattering_per_mm;
};
/// K and S in one band, as a laboratory finds them from reflectances over two cards of reflectances `black` < `white`
/// (Kubelka 1948, no correction for surfaces). NaN where the cards do not show through.
KubelkaMunk KubelkaMunkFromCards(double over_black, double over_white, double black, double white, double thickness_mm);

}  // namespace crownfit
