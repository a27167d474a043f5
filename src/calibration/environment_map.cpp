#include "calibration/environment_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

/// Interval of `ends` (cumulative up to 1) that holds u, and how far into it u lies.
std::pair<size_t, double> Choose(const double* ends, size_t count, double u) {
  const size_t i = std::min<size_t>(std::upper_bound(ends, ends + count, u) - ends, count - 1);
  const double begin = i == 0 ? 0.0 : ends[i - 1], width = ends[i] - begin;
  return {i, width > 0 ? std::clamp((u - begin) / width, 0.0, 1.0) : 0.5};
}

}  // namespace

EnvironmentMap::EnvironmentMap(Image radiance) : radiance_(std::move(radiance)) {
  const size_t width = radiance_.width, height = radiance_.height;
  column_ends_.resize(width * height);
  for (size_t y = 0; y < height; ++y) {
    double sum = 0;
    for (size_t x = 0; x < width; ++x) {
      const float* p = &radiance_.values[3 * (y * width + x)];
      sum += (p[0] + p[1] + p[2]) / 3.0;
      column_ends_[y * width + x] = sum;
    }
    for (size_t x = 0; x < width && sum > 0; ++x) column_ends_[y * width + x] /= sum;
    total_ += sum * SolidAngle(static_cast<int>(y));
    row_ends_.push_back(total_);
  }
  for (double& end : row_ends_) end /= total_;
}

double EnvironmentMap::SolidAngle(int row) const {
  const double top = kPi * row / radiance_.height, bottom = kPi * (row + 1) / radiance_.height;
  return 2.0 * kPi / radiance_.width * (std::cos(top) - std::cos(bottom));
}

size_t EnvironmentMap::PixelOf(const glm::dvec3& d) const {
  const double u = 0.5 * (1.0 - std::atan2(d.x, d.z) / kPi), v = std::acos(std::clamp(d.y, -1.0, 1.0)) / kPi;
  const size_t x = std::min<size_t>(static_cast<size_t>(u * radiance_.width), radiance_.width - 1),
               y = std::min<size_t>(static_cast<size_t>(v * radiance_.height), radiance_.height - 1);
  return y * radiance_.width + x;
}

glm::dvec3 EnvironmentMap::Radiance(const glm::dvec3& direction) const {
  const float* p = &radiance_.values[3 * PixelOf(direction)];
  return {p[0], p[1], p[2]};
}

glm::dvec3 EnvironmentMap::Sample(const glm::dvec2& uniform) const {
  const auto [y, down] = Choose(row_ends_.data(), row_ends_.size(), uniform.x);
  const auto [x, right] = Choose(&column_ends_[y * radiance_.width], radiance_.width, uniform.y);
  const double top = std::cos(kPi * static_cast<double>(y) / radiance_.height),
               bottom = std::cos(kPi * static_cast<double>(y + 1) / radiance_.height);
  const double height = top + down * (bottom - top), sine = std::sqrt(std::max(0.0, 1.0 - height * height));
  const double longitude = kPi * (1.0 - 2.0 * (static_cast<double>(x) + right) / radiance_.width);
  return {sine * std::sin(longitude), height, sine * std::cos(longitude)};
}

double EnvironmentMap::Density(const glm::dvec3& direction) const {
  const float* p = &radiance_.values[3 * PixelOf(direction)];
  return (p[0] + p[1] + p[2]) / 3.0 / total_;
}

std::shared_ptr<const EnvironmentMap> ReadEnvironmentMap(const std::filesystem::path& file) {
  const ImageFile read = ReadImageFile(file);
  const Image& image = read.image;
  if (image.width != 2 * image.height)
    throw InputError(file, "",
                     "an environment map is twice as wide as high, this one is " + std::to_string(image.width) + " x " +
                         std::to_string(image.height),
                     "Give a latitude-longitude panorama.");
  Image radiance(image.width, image.height, 3);
  double sum = 0;
  for (size_t p = 0; p < radiance.values.size() / 3; ++p)
    for (int c = 0; c < 3; ++c) {
      const float v = image.values[p * image.channels + (image.channels >= 3 ? c : 0)];
      if (!(v >= 0 && std::isfinite(v)))
        throw InputError(file, "", "the environment map holds light that is negative or not a number");
      radiance.values[3 * p + c] = read.is_srgb_encoded ? static_cast<float>(LinearFromSrgb(v)) : v;
      sum += radiance.values[3 * p + c];
    }
  if (!(sum > 0)) throw InputError(file, "", "the environment map is black");
  return std::make_shared<EnvironmentMap>(std::move(radiance));
}

}  // namespace crownfit
