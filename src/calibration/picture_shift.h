#pragma once
// Whether the camera moved between two photographs of one scene.

#include <glm/glm.hpp>

#include "photo/image.h"

namespace crownfit {

/// Gradient of one channel, per pixel, from neighbours two pixels away: independent of the pixel's own noise, and
/// within one colour of a mosaic.
inline glm::dvec2 GradientAt(const Image& image, int x, int y, int c) {
  return 0.25 *
         glm::dvec2(image.at(x + 2, y, c) - image.at(x - 2, y, c), image.at(x, y + 2, c) - image.at(x, y - 2, c));
}

/// Shift between two pictures in pixels, by least squares over their differences (Lucas and Kanade 1981). It detects
/// shifts of several pixels but does not measure them.
struct PictureShift {
  glm::dmat2 normal{0.0};
  glm::dvec2 right{0.0};
  void Add(const glm::dvec2& gradient, double difference) {
    normal += glm::outerProduct(gradient, gradient);
    right += difference * gradient;
  }
  double Pixels() const {
    const double determinant = glm::determinant(normal);
    return determinant > 1e-12 * normal[0][0] * normal[1][1] ? glm::length(glm::inverse(normal) * right) : 0.0;
  }
};

}  // namespace crownfit
