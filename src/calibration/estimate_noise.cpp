#include "calibration/estimate_noise.h"

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <tuple>

#include "calibration/picture_shift.h"

namespace crownfit {
namespace {

/// Trimmed mean and variance: values beyond four standard deviations are dust, motion or hot pixels.
struct Moments {
  double mean = 0, variance = 0;
  size_t count = 0;
};

Moments MomentsOf(const std::vector<float>& values) {
  Moments m;
  double low = -1e300, high = 1e300;
  for (int round = 0; round < 4; ++round) {
    double sum = 0, squares = 0;
    size_t count = 0;
    for (const double v : values)
      if (v >= low && v <= high) sum += v, squares += v * v, ++count;
    if (count < 2) return m;
    const double n = static_cast<double>(count), mean = sum / n;
    m = {mean, std::max(0.0, squares / n - mean * mean) * n / (n - 1), count};
    low = mean - 4 * std::sqrt(m.variance);
    high = mean + 4 * std::sqrt(m.variance);
  }
  return m;
}

/// Local change of a picture, from neighbours two pixels away: independent of the pixel's own noise, and within one
/// colour of a mosaic.
double Structure(const Image& image, int x, int y, int c) {
  return std::abs(image.at(x + 2, y, c) - image.at(x - 2, y, c)) +
         std::abs(image.at(x, y + 2, c) - image.at(x, y - 2, c));
}

constexpr int kBins = 20;
constexpr double kLowest = 0.004;  // of full scale

int BinOf(double value, double full) {
  if (value < kLowest * full || value >= full) return -1;
  return static_cast<int>(kBins * std::log(value / (kLowest * full)) / -std::log(kLowest));
}

/// Whether a pixel or one near it is close to saturation: light spills over, and resizing mixes saturated pixels in.
bool IsNearSaturation(const Image& image, int x, int y, int c, double limit) {
  for (int dy = -2; dy <= 2; ++dy)
    for (int dx = -2; dx <= 2; ++dx)
      if (image.at(x + dx, y + dy, c) > limit) return true;
  return false;
}

/// Quantisation step of a file's values; about 0 for floating point.
double StepOf(const Image& image, int c) {
  std::vector<float> values;
  for (size_t i = c; i < image.values.size(); i += image.channels) values.push_back(image.values[i]);
  std::sort(values.begin(), values.end());
  double step = 1.0;
  for (size_t i = 1; i < values.size(); ++i)
    if (values[i] > values[i - 1]) step = std::min<double>(step, values[i] - values[i - 1]);
  return step;
}

struct Level {
  double value, variance, relative_stddev;  ///< of the difference
  double per_gain, per_read;                ///< variance = gain x per_gain + read_noise^2 x per_read
  double departure;                         ///< mean difference over value; 0 where quantisation hides it
};

/// Variances of a pair, level by level. `a` is the brighter picture; a = ratio x b.
void AddLevels(const Image& a, const Image& b, int c, double black, double full, std::vector<Level>& levels,
               double& shift_px) {
  double sum_a = 0, sum_b = 0;
  for (int y = 2; y < a.height - 2; ++y)
    for (int x = 2; x < a.width - 2; ++x) {
      const double va = a.at(x, y, c) - black, vb = b.at(x, y, c) - black;
      if (va > 0.1 * full && va < 0.6 * full && vb > 0 && !IsNearSaturation(a, x, y, c, black + 0.97 * full))
        sum_a += va, sum_b += vb;
    }
  if (sum_b <= 0) return;
  const double ratio = sum_a / sum_b;
  const double step = StepOf(a, c);
  struct Place {
    float structure, difference, mean;
  };
  std::vector<std::vector<Place>> found(kBins);
  PictureShift shift;
  for (int y = 2; y < a.height - 2; ++y)
    for (int x = 2; x < a.width - 2; ++x) {
      const double va = a.at(x, y, c) - black, vb = b.at(x, y, c) - black;
      // The mean with the least noise when the variance is proportional to the value.
      const double mean = ratio * (va + vb) / (1.0 + ratio);
      const int bin = BinOf(mean, full);
      if (bin < 0 || IsNearSaturation(a, x, y, c, black + 0.97 * full)) continue;
      const double structure = (Structure(a, x, y, c) + ratio * Structure(b, x, y, c)) / (2.0 * mean);
      found[bin].push_back(
          {static_cast<float>(structure), static_cast<float>(va - ratio * vb), static_cast<float>(mean)});
      shift.Add(0.5 * (GradientAt(a, x, y, c) + ratio * GradientAt(b, x, y, c)), va - ratio * vb);
    }
  shift_px = std::max(shift_px, shift.Pixels());
  for (int i = 0; i < kBins; ++i) {
    if (found[i].size() < 400) continue;
    std::sort(found[i].begin(), found[i].end(), [](const Place& p, const Place& q) {
      return std::tie(p.structure, p.difference) < std::tie(q.structure, q.difference);
    });
    std::vector<float> differences;
    double sum = 0;
    for (size_t k = 0; k < found[i].size() / 2; ++k)
      differences.push_back(found[i][k].difference), sum += static_cast<double>(found[i][k].mean);
    const Moments m = MomentsOf(differences);
    if (m.count < 100 || m.variance < step * step / 6.0) continue;  // hidden by quantisation
    const double value = sum / static_cast<double>(differences.size());
    levels.push_back({value, m.variance, std::sqrt(2.0 / static_cast<double>(m.count)), value * (1.0 + ratio),
                      1.0 + ratio * ratio, 20.0 * ratio * step < value ? m.mean / value : 0.0});
  }
}

/// The level where values pile up at the end of their range.
std::optional<double> ClippingLevel(const std::vector<std::pair<const Image*, const Image*>>& pairs, int c) {
  float largest = 0;
  for (const auto& [a, b] : pairs)
    for (const Image* image : {a, b})
      for (size_t i = c; i < image->values.size(); i += image->channels) largest = std::max(largest, image->values[i]);
  size_t at_end = 0, all = 0;
  for (const auto& [a, b] : pairs)
    for (const Image* image : {a, b})
      for (size_t i = c; i < image->values.size(); i += image->channels, ++all)
        at_end += image->values[i] > 0.997f * largest;
  if (static_cast<double>(at_end) < 1e-3 * static_cast<double>(all)) return std::nullopt;
  return 0.98 * largest;
}

}  // namespace

std::optional<ChannelNoise> EstimateChannelNoise(const std::vector<std::pair<const Image*, const Image*>>& pairs,
                                                 const std::vector<const Image*>& darks, int channel) {
  ChannelNoise noise;
  std::optional<Level> dark;
  if (!darks.empty()) {
    std::vector<float> values;
    size_t at_zero = 0;
    for (const Image* frame : darks)
      for (size_t i = channel; i < frame->values.size(); i += frame->channels) {
        values.push_back(frame->values[i]);
        at_zero += frame->values[i] <= 0;
      }
    const Moments m = MomentsOf(values);
    noise.black = m.mean;
    const double step = StepOf(*pairs.at(0).first, channel);
    const bool is_hidden = m.variance < step * step / 12.0;  // by quantisation: black is then known to a step
    noise.black_stddev = is_hidden ? step / std::sqrt(12.0) : std::sqrt(m.variance / static_cast<double>(m.count));
    // Values clipped at 0 have lost half of their noise.
    if (!is_hidden && darks.size() > 1 && static_cast<double>(at_zero) < 0.02 * static_cast<double>(values.size())) {
      std::vector<float> differences;
      for (size_t i = channel; i < darks[0]->values.size(); i += darks[0]->channels)
        differences.push_back(darks[1]->values[i] - darks[0]->values[i]);
      const Moments d = MomentsOf(differences);
      dark = Level{0.0, d.variance, std::sqrt(2.0 / static_cast<double>(d.count)), 0.0, 2.0, 0.0};
    }
  }
  noise.saturation = ClippingLevel(pairs, channel);
  const double full = noise.saturation.value_or(1.0) - noise.black;
  std::vector<Level> levels;
  for (const auto& [a, b] : pairs) {
    double more = 0;
    for (size_t i = channel; i < a->values.size(); i += a->channels) more += a->values[i] - b->values[i];
    const bool a_is_brighter = more >= 0;
    AddLevels(a_is_brighter ? *a : *b, a_is_brighter ? *b : *a, channel, noise.black, full, levels, noise.shift_px);
  }
  if (levels.size() < 2) return std::nullopt;
  // End of the linear response: where the brighter picture falls behind.
  double end = full;
  for (const Level& level : levels)
    if (level.departure < -0.02 && level.value > 0.3 * full) end = std::min(end, level.value);
  if (end < full) noise.saturation = noise.black + end;
  std::erase_if(levels, [&](const Level& level) { return level.value >= end; });
  for (const Level& level : levels)
    if (level.value > 0.05 * full) noise.nonlinearity = std::max(noise.nonlinearity, std::abs(level.departure));
  if (dark) levels.push_back(*dark);

  // variance = gain x per_gain + read^2 x per_read, weighted by the line's own prediction.
  double gain = 1e-4, read2 = 1e-8, change = 0;
  glm::dmat2 covariance(0.0);
  for (int round = 0; round < 30; ++round) {
    glm::dmat2 normal(0.0);
    glm::dvec2 right(0.0);
    for (const Level& level : levels) {
      const double expected = std::max(gain, 0.0) * level.per_gain + std::max(read2, 0.0) * level.per_read + 1e-14;
      const double w = 1.0 / std::pow(level.relative_stddev * expected, 2.0);
      const glm::dvec2 row(level.per_gain, level.per_read);
      normal += w * glm::outerProduct(row, row);
      right += w * level.variance * row;
    }
    covariance = glm::inverse(normal);
    const glm::dvec2 solution = covariance * right;
    change = std::abs(solution.x - gain) + std::abs(solution.y - read2);
    gain = solution.x;
    read2 = solution.y;
  }
  noise.settled = change <= 1e-6 * (std::abs(gain) + std::abs(read2));
  constexpr double kNegative = 5.0;  // standard deviations
  double chi2 = 0;
  for (const Level& level : levels) {
    const double expected = gain * level.per_gain + read2 * level.per_read;
    chi2 += std::pow((level.variance - expected) / (level.relative_stddev * std::max(expected, 1e-14)), 2.0);
    if (level.per_gain <= 0) continue;
    // Of a single value at exposure ratio 1.
    const double per_value = level.per_gain / level.value;
    noise.points.emplace_back(level.value, (level.variance - read2 * (level.per_read - per_value)) / per_value,
                              level.relative_stddev * level.variance / per_value);
  }
  noise.chi2 = chi2 / std::max(1.0, static_cast<double>(levels.size()) - 2.0);
  const double inflate = std::sqrt(std::max(1.0, noise.chi2));
  noise.gain = std::max(gain, 0.0);
  noise.gain_stddev = inflate * std::sqrt(covariance[0][0]);
  noise.read_noise = std::sqrt(std::max(read2, 0.0));
  const double read2_stddev = inflate * std::sqrt(covariance[1][1]);
  if (darks.empty() && gain > 0 && read2 < -kNegative * read2_stddev) noise.hidden_black = -read2 / gain;
  noise.read_noise_stddev =
      inflate * std::sqrt(covariance[1][1]) / (2.0 * std::max(noise.read_noise, std::pow(covariance[1][1], 0.25)));
  return noise;
}

}  // namespace crownfit
