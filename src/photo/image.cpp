#include "photo/image.h"

#include <algorithm>
#include <cmath>

namespace crownfit {

Spectrum PixelOf(const Image& image, size_t i) {
  Spectrum pixel(image.channels, 0.0);
  for (int c = 0; c < image.channels; ++c) pixel[c] = image.values[image.channels * i + c];
  return pixel;
}

Image BoxMean(const Image& image, int radius) {
  Image across = image, both = image;
  // Running sums, along rows and then along columns.
  const auto run = [radius](const Image& from, Image& to, bool rows) {
    const int lines = rows ? from.height : from.width, length = rows ? from.width : from.height;
    for (int line = 0; line < lines; ++line)
      for (int c = 0; c < from.channels; ++c) {
        const auto value = [&](int i) { return rows ? from.at(i, line, c) : from.at(line, i, c); };
        double sum = 0;
        for (int i = 0; i < std::min(radius, length); ++i) sum += value(i);
        for (int i = 0; i < length; ++i) {
          if (i + radius < length) sum += value(i + radius);
          if (i - radius - 1 >= 0) sum -= value(i - radius - 1);
          const int count = std::min(i + radius, length - 1) - std::max(i - radius, 0) + 1;
          (rows ? to.at(i, line, c) : to.at(line, i, c)) = static_cast<float>(sum / count);
        }
      }
  };
  run(image, across, true);
  run(across, both, false);
  return both;
}

double Bilinear(const Image& image, const glm::dvec2& pixel, int c) {
  const double px = pixel.x - 0.5, py = pixel.y - 0.5;
  const double right = image.width - 1, bottom = image.height - 1;
  const int x = static_cast<int>(std::clamp(std::floor(px), 0.0, right)),
            y = static_cast<int>(std::clamp(std::floor(py), 0.0, bottom));
  const int x1 = std::min(x + 1, image.width - 1), y1 = std::min(y + 1, image.height - 1);
  const double u = std::clamp(px - x, 0.0, 1.0), v = std::clamp(py - y, 0.0, 1.0);
  return (1 - v) * ((1 - u) * image.at(x, y, c) + u * image.at(x1, y, c)) +
         v * ((1 - u) * image.at(x, y1, c) + u * image.at(x1, y1, c));
}

}  // namespace crownfit
