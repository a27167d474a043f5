#include "photo/figures.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

constexpr float kPaper = 1.0f;

glm::vec3 ColourOf(double difference) {
  for (const DifferenceStep& step : kDifferenceSteps)
    if (difference <= step.below) return step.colour;
  return kDifferenceSteps.back().colour;
}

void Put(Image& image, int x, int y, const glm::vec3& colour) {
  if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
  for (int c = 0; c < 3; ++c) image.at(x, y, c) = colour[c];
}

void DrawLegend(Image& image, int x, int y, int line) {
  for (const DifferenceStep& step : kDifferenceSteps) {
    for (int v = 0; v < line - 6; ++v)
      for (int u = 0; u < 2 * line; ++u) Put(image, x + u, y + v, step.colour);
    DrawText(image, x + 2 * line + 8, y + line - 8, line - 6, step.label, 0.0f);
    y += line;
  }
}

}  // namespace

PixelBox BoxAround(const Image& map) {
  PixelBox box{map.width, map.height, 0, 0};
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (map.at(x, y, 0) < 0) continue;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  if (box.x0 >= box.x1) return {0, 0, map.width, map.height};
  const int margin = 6 + (box.x1 - box.x0) / 12;
  return {std::max(0, box.x0 - margin), std::max(0, box.y0 - margin), std::min(map.width, box.x1 + margin),
          std::min(map.height, box.y1 + margin)};
}

Image DisplayPicture(const Image& linear, double scale, const ColourTransform& rgb_from_sensor) {
  Image picture(linear.width, linear.height, 3);
  for (size_t i = 0; 3 * i < picture.values.size(); ++i) {
    const glm::dvec3 rgb = scale * rgb_from_sensor(PixelOf(linear, i));
    for (int c = 0; c < 3; ++c) picture.values[3 * i + c] = static_cast<float>(SrgbFromLinear(rgb[c]));
  }
  return picture;
}

Image DifferenceColours(const ColourDifference& difference, const glm::vec3& elsewhere) {
  const Image& map = difference.map;
  Image colours(map.width, map.height, 3);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x) Put(colours, x, y, map.at(x, y, 0) < 0 ? elsewhere : ColourOf(map.at(x, y, 0)));
  return colours;
}

Image DifferenceFigure(const ColourDifference& difference) {
  constexpr int kLine = 22;
  const Image& map = difference.map;
  Image figure(std::max(map.width, 12 * kLine), map.height + 6 * kLine, 3, kPaper);
  for (int y = 0; y < map.height; ++y)
    for (int x = 0; x < map.width; ++x)
      if (map.at(x, y, 0) >= 0) Put(figure, x, y, ColourOf(map.at(x, y, 0)));
  DrawLegend(figure, 8, map.height + kLine / 2, kLine);
  return figure;
}

Image TriptychFigure(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                     const ColourDifference& difference, const ColourTransform& rgb_from_sensor,
                     const std::string& title) {
  const PixelBox box = BoxAround(difference.map);
  const int w = box.x1 - box.x0, h = box.y1 - box.y0, zoom = std::clamp(360 / std::max(w, h), 1, 8);
  const int panel_w = w * zoom, panel_h = h * zoom, gap = 12, head = 56, line = 22, foot = 6 * line;
  Image figure(std::max(3 * panel_w + 4 * gap, 620), head + panel_h + foot, 3, kPaper);
  const double scale = ComparisonScale(photograph, mask, rgb_from_sensor);
  const Image left = DisplayPicture(photograph, scale, rgb_from_sensor),
              middle = DisplayPicture(prediction, scale, rgb_from_sensor);
  for (int y = 0; y < panel_h; ++y) {
    for (int x = 0; x < panel_w; ++x) {
      const int px = box.x0 + x / zoom, py = box.y0 + y / zoom;
      const double d = difference.map.at(px, py, 0);
      Put(figure, gap + x, head + y, {left.at(px, py, 0), left.at(px, py, 1), left.at(px, py, 2)});
      Put(figure, 2 * gap + panel_w + x, head + y, {middle.at(px, py, 0), middle.at(px, py, 1), middle.at(px, py, 2)});
      Put(figure, 3 * gap + 2 * panel_w + x, head + y, d < 0 ? glm::vec3(0.9f) : ColourOf(d));
    }
  }
  DrawText(figure, gap, 22, 16, title, 0.0f);
  const char* heads[] = {"photograph", "prediction", "CIEDE2000"};
  for (int i = 0; i < 3; ++i) DrawText(figure, gap + i * (panel_w + gap), head - 10, 15, heads[i], 0.0f);
  DrawLegend(figure, gap, head + panel_h + line / 2, line);
  DrawText(figure, 310, head + panel_h + line + 4, 15,
           Printed("8 x 8 blocks: median %.2f, 95 %% %.2f", difference.median, difference.p95), 0.0f);
  DrawText(
      figure, 310, head + panel_h + 2 * line + 4, 15,
      Printed("%.0f %% not seen, %.0f %% acceptable", 100 * difference.share_below_pt, 100 * difference.share_below_at),
      0.0f);
  return figure;
}

}  // namespace crownfit
