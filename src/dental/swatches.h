#pragma once
// Pictures of colour samples.

#include <string>
#include <vector>

#include "photo/image.h"

namespace crownfit {

/// A sample over three backgrounds, linear sRGB, and its caption.
struct Swatch {
  glm::dvec3 over_black, over_white, over_stump;
  std::vector<std::string> captions;
};

/// Samples side by side, each lying across a black card, a white card and a stump of this colour. sRGB in [0, 1].
Image SwatchFigure(const std::vector<Swatch>& swatches, const glm::dvec3& black, const glm::dvec3& white,
                   const glm::dvec3& stump);

}  // namespace crownfit
