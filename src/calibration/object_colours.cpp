#include "calibration/object_colours.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace crownfit {
namespace {

constexpr int kShares = ColourOdds::kShares, kLevels = ColourOdds::kLevels;

/// A picture smaller by a whole factor, averaged.
Image Reduced(const Image& image, int factor) {
  Image small(image.width / factor, image.height / factor, image.channels);
  for (int y = 0; y < small.height * factor; ++y)
    for (int x = 0; x < small.width * factor; ++x)
      for (int c = 0; c < image.channels; ++c)
        small.at(x / factor, y / factor, c) += image.at(x, y, c) / static_cast<float>(factor * factor);
  return small;
}

Camera ReducedCamera(const Camera& camera, int factor) {
  Camera small = camera;
  small.width = camera.width / factor;
  small.height = camera.height / factor;
  for (double* v : {&small.fx, &small.fy, &small.cx, &small.cy}) *v /= factor;
  return small;
}

std::vector<uint8_t> Dilated(const std::vector<uint8_t>& mask, int width, int height, int radius) {
  Image soft(width, height, 1);
  for (size_t p = 0; p < mask.size(); ++p) soft.values[p] = mask[p];
  soft = BoxMean(soft, radius);
  std::vector<uint8_t> grown(mask.size());
  for (size_t p = 0; p < mask.size(); ++p) grown[p] = soft.values[p] > 0;
  return grown;
}
void Smooth(std::vector<double>& histogram) {
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<double> from = histogram;
    for (int k = 0; k < kLevels; ++k)
      for (int i = 0; i < kShares; ++i)
        for (int j = 0; j < kShares; ++j) {
          const auto at = [&](int a, int b) {
            return from[(k * kShares + std::clamp(a, 0, kShares - 1)) * kShares + std::clamp(b, 0, kShares - 1)];
          };
          histogram[(k * kShares + i) * kShares + j] =
              0.5 * at(i, j) + 0.125 * (at(i - 1, j) + at(i + 1, j) + at(i, j - 1) + at(i, j + 1));
        }
  }
}
}  // namespace

int ColourOdds::BinOf(const Image& image, size_t pixel, double white) {
  const double r = std::max(0.0f, image.values[3 * pixel]), g = std::max(0.0f, image.values[3 * pixel + 1]),
               b = std::max(0.0f, image.values[3 * pixel + 2]);
  const double sum = r + g + b + 1e-9;
  const int i = std::clamp(static_cast<int>(kShares * (r / sum - 0.2) / 0.6), 0, kShares - 1);
  const int j = std::clamp(static_cast<int>(kShares * (b / sum) / 0.5), 0, kShares - 1);
  const int k =
      std::clamp(static_cast<int>(kLevels * (1.0 + std::log2(sum / (3 * white) + 1e-9) / kLevels)), 0, kLevels - 1);
  return (k * kShares + i) * kShares + j;
}
ColourOdds::ColourOdds(const Image& image, const std::vector<uint8_t>& mask, double white) {
  // Surroundings: pixels within a tenth of the picture from the object.
  std::vector<double> inside(odds.size(), 0.0), outside(odds.size(), 0.0);
  const std::vector<uint8_t> near = Dilated(mask, image.width, image.height, image.width / 10);
  for (size_t p = 0; p < mask.size(); ++p)
    if (near[p]) (mask[p] ? inside : outside)[BinOf(image, p, white)] += 1;
  Smooth(inside);
  Smooth(outside);
  const double in = std::accumulate(inside.begin(), inside.end(), 1e-9),
               out = std::accumulate(outside.begin(), outside.end(), 1e-9);
  for (size_t b = 0; b < odds.size(); ++b) {
    const double a = inside[b] / in, o = outside[b] / out;
    odds[b] = std::log((a + 1e-4) / (o + 1e-4));
    contrast += 0.5 * std::abs(a - o);
  }
}
Level::Level(const Image& linear, const Camera& of_linear, int factor)
    : image(factor > 1 ? Reduced(linear, factor) : linear), camera(ReducedCamera(of_linear, factor)) {
  std::vector<float> values = image.values;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() * 98 / 100);
  std::nth_element(values.begin(), at, values.end());
  white = std::max(1e-9f, *at);
}

/// Log odds of every pixel, limited so that no single colour decides.
Image OddsImage(const Level& level, const ColourOdds& colours) {
  Image odds(level.image.width, level.image.height, 1);
  for (size_t p = 0; p < odds.values.size(); ++p)
    odds.values[p] =
        static_cast<float>(std::clamp(colours.odds[ColourOdds::BinOf(level.image, p, level.white)], -3.0, 3.0));
  return odds;
}

}  // namespace crownfit
