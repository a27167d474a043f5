#pragma once
// Pictures as plain arrays.

#include <cstddef>
#include <glm/glm.hpp>
#include <vector>

#include "photo/spectrum.h"

namespace crownfit {

/// Row by row from the top left; `channels` values per pixel.
struct Image {
  int width = 0, height = 0, channels = 3;
  std::vector<float> values;

  Image() = default;
  Image(int w, int h, int c, float value = 0.0f)
      : width(w), height(h), channels(c), values(static_cast<size_t>(w) * h * c, value) {}
  float& at(int x, int y, int c) { return values[(static_cast<size_t>(y) * width + x) * channels + c]; }
  float at(int x, int y, int c) const { return values[(static_cast<size_t>(y) * width + x) * channels + c]; }
};

/// The channels of the pixel number `i`.
Spectrum PixelOf(const Image& image, size_t i);

/// Means over squares of 2 radius + 1 pixels, cut off at the borders.
Image BoxMean(const Image& image, int radius);

/// Bilinear between pixel centres, which lie at halves; clamped at the border.
double Bilinear(const Image& image, const glm::dvec2& pixel, int channel);

}  // namespace crownfit
