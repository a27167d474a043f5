#pragma once
// What dentistry measures of a translucent sample over a black and a white card.

#include <glm/glm.hpp>

namespace crownfit {

struct Translucency {
  double tp00;            ///< translucency parameter: CIEDE2000 between the two (Johnston, Ma and Kienle 1995, with it)
  double tp_ab;           ///< the same by CIELAB's plain distance
  double contrast_ratio;  ///< luminance over black / over white: 0 clear, 1 opaque
};
/// Of linear sRGB over black and over white.
Translucency TranslucencyOf(const glm::dvec3& over_black, const glm::dvec3& over_white);

struct KubelkaMunk {
  double absorption_per_mm, scattering_per_mm;
};
/// K and S as a laboratory finds them in one band from reflectances over two cards of reflectances `black` < `white`
/// (Kubelka 1948, no correction for surfaces). NaN where the two tell nothing: what is under it does not show.
KubelkaMunk KubelkaMunkFromCards(double over_black, double over_white, double black, double white, double thickness_mm);

}  // namespace crownfit
