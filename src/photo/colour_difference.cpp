#include "photo/colour_difference.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

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

/// Sums over any rectangle of the compared pixels of both pictures, from summed-area tables.
class RectangleSums {
 public:
  struct Sum {
    glm::dvec3 photograph{0.0}, prediction{0.0};
    double pixels = 0;
  };
  RectangleSums(int width, int height)
      : width_(width), height_(height), sums_(static_cast<size_t>(width + 1) * (height + 1)) {}
  void Add(int x, int y, const glm::dvec3& photograph, const glm::dvec3& prediction) {
    At(x + 1, y + 1) = {photograph, prediction, 1.0};
  }
  void Accumulate() {
    for (int y = 1; y <= height_; ++y)
      for (int x = 1; x <= width_; ++x) {
        Put(At(x, y), At(x - 1, y), 1.0);
        Put(At(x, y), At(x, y - 1), 1.0);
        Put(At(x, y), At(x - 1, y - 1), -1.0);
      }
  }
  /// Sums over the kBlock x kBlock pixels around one.
  Sum Around(int x, int y) {
    const int x0 = std::max(0, x - kBlock / 2), y0 = std::max(0, y - kBlock / 2), x1 = std::min(width_, x + kBlock / 2),
              y1 = std::min(height_, y + kBlock / 2);
    Sum sum = At(x1, y1);
    Put(sum, At(x0, y1), -1.0);
    Put(sum, At(x1, y0), -1.0);
    Put(sum, At(x0, y0), 1.0);
    return sum;
  }

 private:
  Sum& At(int x, int y) { return sums_[static_cast<size_t>(y) * (width_ + 1) + x]; }
  static void Put(Sum& to, const Sum& from, double sign) {
    to.photograph += sign * from.photograph;
    to.prediction += sign * from.prediction;
    to.pixels += sign * from.pixels;
  }
  int width_, height_;
  std::vector<Sum> sums_;
};

}  // namespace

double ComparisonScale(const Image& photograph, const std::vector<uint8_t>& mask,
                       const ColourTransform& rgb_from_sensor) {
  std::vector<double> luminance;
  for (size_t i = 0; i < mask.size(); ++i) {
    if (!mask[i]) continue;
    luminance.push_back(LuminanceOf(rgb_from_sensor(PixelOf(photograph, i))));
  }
  const double p95 = Quantile(std::move(luminance), 0.95);
  return p95 > 0 ? 0.6 / p95 : 1.0;
}

ColourDifference ComparePictures(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                                 const ColourTransform& rgb_from_sensor, std::optional<double> common_scale) {
  ColourDifference result;
  result.map = Image(photograph.width, photograph.height, 1, -1.0f);
  const double scale = common_scale ? *common_scale : ComparisonScale(photograph, mask, rgb_from_sensor);
  std::map<std::pair<int, int>, std::array<glm::dvec3, 3>> blocks;  // sums of both, and the count
  std::vector<double> per_pixel;
  RectangleSums sums(photograph.width, photograph.height);
  for (int y = 0; y < photograph.height; ++y) {
    for (int x = 0; x < photograph.width; ++x) {
      const size_t i = static_cast<size_t>(y) * photograph.width + x;
      if (!mask[i]) continue;
      const glm::dvec3 a = scale * rgb_from_sensor(PixelOf(photograph, i)),
                       b = scale * rgb_from_sensor(PixelOf(prediction, i));
      per_pixel.push_back(Ciede2000(LabFromLinearRgb(a), LabFromLinearRgb(b)));
      sums.Add(x, y, a, b);
      auto& block = blocks.try_emplace({y / kBlock, x / kBlock}, std::array<glm::dvec3, 3>{}).first->second;
      block[0] += a;
      block[1] += b;
      block[2].x += 1;
    }
  }
  sums.Accumulate();
  for (int y = 0; y < photograph.height; ++y)
    for (int x = 0; x < photograph.width; ++x) {
      const size_t i = static_cast<size_t>(y) * photograph.width + x;
      if (!mask[i]) continue;
      const RectangleSums::Sum near = sums.Around(x, y);
      result.map.values[i] = static_cast<float>(
          Ciede2000(LabFromLinearRgb(near.photograph / near.pixels), LabFromLinearRgb(near.prediction / near.pixels)));
    }
  std::vector<double> per_block;
  std::array<glm::dvec3, 2> all{};
  for (const auto& [place, sum] : blocks) {
    per_block.push_back(Ciede2000(LabFromLinearRgb(sum[0] / sum[2].x), LabFromLinearRgb(sum[1] / sum[2].x)));
    for (int i = 0; i < 2; ++i) all[i] += sum[i] / static_cast<double>(per_pixel.size());
  }
  result.photograph_lab = LabFromLinearRgb(all[0]);
  result.prediction_lab = LabFromLinearRgb(all[1]);
  result.pixels = per_pixel.size();
  result.blocks = per_block.size();
  for (double d : per_block) result.mean += d / static_cast<double>(per_block.size());
  const auto share_below = [&](double threshold) {
    const auto below = std::count_if(per_block.begin(), per_block.end(), [&](double d) { return d <= threshold; });
    return static_cast<double>(below) / static_cast<double>(std::max<size_t>(1, per_block.size()));
  };
  result.share_below_pt = share_below(kPerceptible);
  result.share_below_at = share_below(kAcceptable);
  result.median = Quantile(per_block, 0.5);
  result.p95 = Quantile(per_block, 0.95);
  result.pixel_median = Quantile(per_pixel, 0.5);
  result.pixel_p95 = Quantile(per_pixel, 0.95);
  return result;
}

}  // namespace crownfit
