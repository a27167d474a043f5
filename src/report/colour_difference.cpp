#include "report/colour_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace crownfit {
namespace {

constexpr int kBlock = 8;

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double at = q * static_cast<double>(values.size() - 1);
  const size_t i = static_cast<size_t>(at);
  const double f = at - static_cast<double>(i);
  return i + 1 < values.size() ? values[i] + f * (values[i + 1] - values[i]) : values[i];
}

glm::dvec3 PixelOf(const Image& image, size_t i) {
  return {image.values[3 * i], image.values[3 * i + 1], image.values[3 * i + 2]};
}

}  // namespace

glm::dvec3 LabFromLinearRgb(const glm::dvec3& rgb) {
  // IEC 61966-2-1 primaries, each row divided by its sum so that white (1,1,1) is the reference white exactly.
  const double x = 0.4124564 * rgb.x + 0.3575761 * rgb.y + 0.1804375 * rgb.z;
  const double y = 0.2126729 * rgb.x + 0.7151522 * rgb.y + 0.0721750 * rgb.z;
  const double z = 0.0193339 * rgb.x + 0.1191920 * rgb.y + 0.9503041 * rgb.z;
  const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
  const double fx = f(x / 0.95047), fy = f(y), fz = f(z / 1.08883);
  return {116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)};
}

double Ciede2000(const glm::dvec3& lab1, const glm::dvec3& lab2) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  const double c_mean = 0.5 * (std::hypot(lab1.y, lab1.z) + std::hypot(lab2.y, lab2.z));
  const double c7 = std::pow(c_mean, 7), g = 0.5 * (1.0 - std::sqrt(c7 / (c7 + std::pow(25.0, 7))));
  const double a1 = (1.0 + g) * lab1.y, a2 = (1.0 + g) * lab2.y;
  const double c1 = std::hypot(a1, lab1.z), c2 = std::hypot(a2, lab2.z);
  const auto hue = [&](double a, double b) {
    if (a == 0 && b == 0) return 0.0;
    const double h = std::atan2(b, a) / kDegree;
    return h < 0 ? h + 360.0 : h;
  };
  const double h1 = hue(a1, lab1.z), h2 = hue(a2, lab2.z);
  const bool grey = c1 * c2 == 0;
  double dh = grey ? 0.0 : h2 - h1;
  if (dh > 180) dh -= 360;
  if (dh < -180) dh += 360;
  const double dl = lab2.x - lab1.x, dc = c2 - c1, dH = 2 * std::sqrt(c1 * c2) * std::sin(0.5 * dh * kDegree);
  const double l = 0.5 * (lab1.x + lab2.x), c = 0.5 * (c1 + c2);
  double h = h1 + h2;
  if (!grey) {
    if (std::abs(h1 - h2) > 180) h += h1 + h2 < 360 ? 360 : -360;
    h *= 0.5;
  }
  const double t = 1 - 0.17 * std::cos((h - 30) * kDegree) + 0.24 * std::cos(2 * h * kDegree) +
                   0.32 * std::cos((3 * h + 6) * kDegree) - 0.20 * std::cos((4 * h - 63) * kDegree);
  const double cc7 = std::pow(c, 7), rc = 2 * std::sqrt(cc7 / (cc7 + std::pow(25.0, 7)));
  const double turn = 30 * std::exp(-std::pow((h - 275) / 25, 2)), rt = -rc * std::sin(2 * turn * kDegree);
  const double l50 = (l - 50) * (l - 50), sl = 1 + 0.015 * l50 / std::sqrt(20 + l50), sc = 1 + 0.045 * c,
               sh = 1 + 0.015 * c * t;
  const double u = dl / sl, v = dc / sc, w = dH / sh;
  return std::sqrt(std::max(0.0, u * u + v * v + w * w + rt * v * w));
}

double ComparisonScale(const Image& photograph, const std::vector<uint8_t>& mask, const glm::dmat3& rgb_from_sensor) {
  std::vector<double> luminance;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    const glm::dvec3 rgb = rgb_from_sensor * PixelOf(photograph, i);
    luminance.push_back(0.2126729 * rgb.x + 0.7151522 * rgb.y + 0.0721750 * rgb.z);
  }
  const double p95 = Quantile(std::move(luminance), 0.95);
  return p95 > 0 ? 0.6 / p95 : 1.0;
}

ColourDifference ComparePictures(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                                 const glm::dmat3& rgb_from_sensor) {
  ColourDifference result;
  result.map = Image(photograph.width, photograph.height, 1, -1.0f);
  const glm::dmat3 to_rgb = ComparisonScale(photograph, mask, rgb_from_sensor) * rgb_from_sensor;
  std::map<std::pair<int, int>, std::array<glm::dvec3, 3>> blocks;  // sums of both, and the count
  std::vector<double> per_pixel;
  for (int y = 0; y < photograph.height; ++y) {
    for (int x = 0; x < photograph.width; ++x) {
      const size_t i = static_cast<size_t>(y) * photograph.width + x;
      if (!mask[i]) continue;
      const glm::dvec3 a = to_rgb * PixelOf(photograph, i), b = to_rgb * PixelOf(prediction, i);
      per_pixel.push_back(Ciede2000(LabFromLinearRgb(a), LabFromLinearRgb(b)));
      result.map.values[i] = static_cast<float>(per_pixel.back());
      auto& block = blocks.try_emplace({y / kBlock, x / kBlock}, std::array<glm::dvec3, 3>{}).first->second;
      block[0] += a;
      block[1] += b;
      block[2].x += 1;
    }
  }
  std::vector<double> per_block;
  for (const auto& [place, sum] : blocks)
    per_block.push_back(Ciede2000(LabFromLinearRgb(sum[0] / sum[2].x), LabFromLinearRgb(sum[1] / sum[2].x)));
  result.pixels = per_pixel.size();
  result.blocks = per_block.size();
  for (double d : per_block) {
    result.mean += d / static_cast<double>(per_block.size());
    result.share_below_pt += (d <= kPerceptible) / static_cast<double>(per_block.size());
    result.share_below_at += (d <= kAcceptable) / static_cast<double>(per_block.size());
  }
  result.median = Quantile(per_block, 0.5);
  result.p95 = Quantile(per_block, 0.95);
  result.pixel_median = Quantile(per_pixel, 0.5);
  result.pixel_p95 = Quantile(per_pixel, 0.95);
  return result;
}

}  // namespace crownfit
