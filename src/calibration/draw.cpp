#include "calibration/draw.h"

#include <algorithm>
#include <cmath>

#include "photo/photograph.h"

namespace crownfit {
namespace {

void Paint(Image& image, int x, int y, const glm::dvec3& colour) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  for (int c = 0; c < image.channels; ++c) image.at(x, y, c) = static_cast<float>(colour[std::min(c, 2)]);
}

}  // namespace

void DrawLine(Image& image, glm::dvec2 from, glm::dvec2 to, const glm::dvec3& colour) {
  const double length = std::max(std::abs(to.x - from.x), std::abs(to.y - from.y));
  if (!(length < 1e5)) return;
  const int steps = static_cast<int>(length) + 1;
  for (int i = 0; i <= steps; ++i) {
    const glm::dvec2 p = glm::mix(from, to, i / static_cast<double>(steps));
    Paint(image, static_cast<int>(std::floor(p.x)), static_cast<int>(std::floor(p.y)), colour);
  }
}

void DrawDot(Image& image, glm::dvec2 centre, double radius, const glm::dvec3& colour) {
  for (int y = static_cast<int>(std::floor(centre.y - radius)); y <= centre.y + radius; ++y)
    for (int x = static_cast<int>(std::floor(centre.x - radius)); x <= centre.x + radius; ++x)
      if (std::hypot(x + 0.5 - centre.x, y + 0.5 - centre.y) <= radius) Paint(image, x, y, colour);
}

void DrawRectangle(Image& image, glm::dvec2 low, glm::dvec2 high, const glm::dvec3& colour) {
  DrawLine(image, low, {high.x, low.y}, colour);
  DrawLine(image, {high.x, low.y}, high, colour);
  DrawLine(image, high, {low.x, high.y}, colour);
  DrawLine(image, {low.x, high.y}, low, colour);
}

void FillRectangle(Image& image, glm::dvec2 low, glm::dvec2 high, const glm::dvec3& colour) {
  for (int y = static_cast<int>(low.y); y < high.y; ++y)
    for (int x = static_cast<int>(low.x); x < high.x; ++x) Paint(image, x, y, colour);
}

Image DisplayCopy(const Image& linear, double zoom) {
  Image picture(std::max(1, static_cast<int>(linear.width * zoom)), std::max(1, static_cast<int>(linear.height * zoom)),
                3);
  std::vector<float> values = linear.values;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 99 / 100);
  std::nth_element(values.begin(), at, values.end());
  const double white = std::max(1e-9f, *at);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < picture.width; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y, c) = static_cast<float>(SrgbFromLinear(
            linear.at(std::min(linear.width - 1, static_cast<int>(x / zoom)),
                      std::min(linear.height - 1, static_cast<int>(y / zoom)), std::min(c, linear.channels - 1)) /
            white));
  return picture;
}

glm::dvec3 DistinctColour(size_t index) {
  static const glm::dvec3 colours[] = {{0.12, 0.47, 0.71}, {0.84, 0.15, 0.16}, {0.17, 0.63, 0.17}, {0.58, 0.40, 0.74},
                                       {1.00, 0.50, 0.05}, {0.09, 0.75, 0.81}, {0.55, 0.34, 0.29}, {0.89, 0.47, 0.76}};
  return colours[index % std::size(colours)];
}

void AppendBelow(Image& all, const Image& next) {
  Image both(std::max(all.width, next.width), all.height + next.height, 3, 1.0f);
  for (const auto& [from, top] : {std::pair<const Image*, int>{&all, 0}, {&next, all.height}})
    for (int y = 0; y < from->height; ++y)
      for (int x = 0; x < from->width; ++x)
        for (int c = 0; c < 3; ++c) both.at(x, top + y, c) = from->at(x, y, c);
  all = both;
}

}  // namespace crownfit
