#include "calibration/exposure_series.h"

#include <algorithm>
#include <cmath>
#include <opencv2/photo.hpp>

#include "base/error.h"
#include "calibration/picture_shift.h"

namespace crownfit {

namespace {

double SaturationOf(const SensorNoise& noise, int channel) {
  constexpr double kUnknown = 0.98;
  return noise.saturation[channel] > 0 ? noise.saturation[channel] : kUnknown;
}

/// Shift between two exposures, from pixels where both show a signal and neither they nor their neighbours saturate.
double ShiftOf(const Image& shorter, const Image& longer, double of_times, const SensorNoise& noise) {
  double most = 0;
  for (int c = 0; c < shorter.channels; ++c) {
    const int known = std::min(c, 2);
    const double black = noise.black[known], full = SaturationOf(noise, known) - black;
    PictureShift shift;
    for (int y = 2; y < shorter.height - 2; ++y)
      for (int x = 2; x < shorter.width - 2; ++x) {
        const double a = of_times * (shorter.at(x, y, c) - black), b = longer.at(x, y, c) - black;
        if (std::max(a, b) > 0.6 * full || std::min(a, b) < 0.05 * full) continue;
        const glm::dvec2 gradient = GradientAt(longer, x, y, c);
        if (glm::length(gradient) < 0.1 * full) shift.Add(gradient, b - a);
      }
    most = std::max(most, shift.Pixels());
  }
  return most;
}

}  // namespace

MergedExposures MergeExposures(const ExposureSeries& series) {
  const size_t count = series.photographs.size();
  Check(count > 1 && series.times.size() == count, "a series has several exposures, each with its time");
  const Image& first = series.photographs[0];
  const auto known = [&](size_t c) { return static_cast<int>(first.channels > 4 ? c : std::min<size_t>(c, 2)); };
  const auto saturation = [&](size_t c) { return SaturationOf(series.noise, known(c)); };
  const SensorNoise& noise = series.noise;
  const auto black = [&](size_t c) { return noise.black[known(c)]; };
  MergedExposures merged;
  merged.linear = Image(first.width, first.height, first.channels);
  merged.variance = merged.linear;
  size_t saturated = 0;
  for (size_t i = 0; i < first.values.size(); ++i) {
    const size_t c = i % first.channels;
    double weights = 0, sum = 0;
    for (size_t k = 0; k < count; ++k) {
      const double stored = series.photographs[k].values[i];
      if (k > 0 && stored >= saturation(c)) continue;
      const double value = stored - black(c), scale = series.times[0] / series.times[k];
      // Weights use the value expected from the shorter exposures: weights from a value's own noise would favour low
      // values.
      const double expected = weights > 0 ? sum / weights / scale : value;
      const double read = noise.read_noise[known(c)], relative = series.noise.relative * expected;
      const double variance =
          scale * scale * (noise.gain[known(c)] * std::max(0.0, expected) + read * read + relative * relative);
      weights += 1.0 / std::max(variance, 1e-18);
      sum += scale * value / std::max(variance, 1e-18);
      if (k == 0 && stored >= saturation(c)) {
        ++saturated;
        break;
      }
    }
    merged.linear.values[i] = static_cast<float>(sum / weights);
    merged.variance.values[i] = static_cast<float>(1.0 / weights);
  }
  merged.saturation = saturation(0) - black(0);
  for (int c = 1; c < first.channels; ++c) merged.saturation = std::min(merged.saturation, saturation(c) - black(c));
  merged.share_saturated = static_cast<double>(saturated) / static_cast<double>(first.values.size());
  for (size_t k = 0; k + 1 < count; ++k) {
    const double of_times = series.times[k + 1] / series.times[k];
    double shorter = 0, longer = 0;
    const auto sum_where = [&](const auto& expected) {
      for (size_t i = 0; i < first.values.size(); ++i) {
        const size_t c = i % first.channels;
        const double a = series.photographs[k].values[i], b = series.photographs[k + 1].values[i];
        const double of_longer = expected(a - black(c), b - black(c));
        if (of_longer < 0.15 || of_longer > 0.5 * saturation(c) || std::max(a, b) >= saturation(c)) continue;
        shorter += a - black(c);
        longer += b - black(c);
      }
    };
    // Pixels are selected by the value that the shorter exposure predicts for the longer one. If none qualifies, the
    // times may be wrong, and the longer exposure's own value decides.
    sum_where([&](double a, double) { return a * of_times; });
    if (!(longer > 0)) sum_where([](double, double b) { return b; });
    merged.time_ratios.emplace_back();
    if (!(longer > 0)) continue;
    const double ratio = longer / std::max(shorter, 1e-12) / of_times;
    merged.time_ratios.back() = ratio;
    merged.worst_ratio = std::max(merged.worst_ratio, std::abs(ratio - 1.0));
    merged.shift_px = std::max(
        merged.shift_px, ShiftOf(series.photographs[k], series.photographs[k + 1], ratio * of_times, series.noise));
  }
  return merged;
}

std::vector<std::array<double, 3>> EstimateResponse(const std::vector<ImageFile>& photographs,
                                                    const std::vector<double>& times) {
  std::vector<cv::Mat> images;
  for (const ImageFile& photo : photographs) {
    const Image& image = photo.image;
    cv::Mat mat(image.height, image.width, CV_8UC3);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < 3; ++c)
          mat.at<cv::Vec3b>(y, x)[c] = cv::saturate_cast<uchar>(255.0f * image.at(x, y, image.channels < 3 ? 0 : c));
    images.push_back(mat);
  }
  cv::Mat response;
  const std::vector<float> seconds(times.begin(), times.end());
  cv::createCalibrateDebevec(200, 20.0f)->process(images, response, seconds);
  // Near the top OpenCV's weights are small and clipped values pull the curve up, by 20 % at 240 and 70 % at 250. From
  // 220 on it continues as the power law that it follows below.
  constexpr int kFrom = 170, kTo = 220;
  std::vector<std::array<double, 3>> inverse(256);
  for (int c = 0; c < 3; ++c) {
    const auto known = [&](int v) { return static_cast<double>(response.at<cv::Vec3f>(v)[c]); };
    const double exponent = std::log(known(kTo) / known(kFrom)) / std::log(static_cast<double>(kTo) / kFrom);
    for (int v = 0; v < 256; ++v) {
      inverse[v][c] = v <= kTo ? known(v) : known(kTo) * std::pow(static_cast<double>(v) / kTo, exponent);
      if (v > 0) inverse[v][c] = std::max(inverse[v][c], inverse[v - 1][c]);
    }
    for (int v = 0; v < 256; ++v) inverse[v][c] /= inverse[255][c];
  }
  return inverse;
}

Image Decoded(const Image& encoded, const std::vector<std::array<double, 3>>& response) {
  Image linear = encoded;
  for (size_t i = 0; i < linear.values.size(); ++i) {
    const double at = 255.0 * std::clamp(linear.values[i], 0.0f, 1.0f);
    const int low = std::min(254, static_cast<int>(at));
    const size_t c = std::min<size_t>(i % linear.channels, 2);
    linear.values[i] = static_cast<float>(response[low][c] + (at - low) * (response[low + 1][c] - response[low][c]));
  }
  return linear;
}

}  // namespace crownfit
