#include "support/rendered_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "base/random.h"

namespace crownfit {
namespace {

bool IsInside(const std::vector<glm::dvec2>& outline, const glm::dvec2& p) {
  bool inside = false;
  for (size_t i = 0, j = outline.size() - 1; i < outline.size(); j = i++) {
    const glm::dvec2 &a = outline[i], &b = outline[j];
    if ((a.y > p.y) != (b.y > p.y) && p.x < (b.x - a.x) * (p.y - a.y) / (b.y - a.y) + a.x) inside = !inside;
  }
  return inside;
}

/// The print at 0.02 mm.
struct Raster {
  static constexpr double kStep_mm = 0.02;
  int width, height;
  std::vector<float> grey;

  explicit Raster(const PrintedTarget& target)
      : width(static_cast<int>(target.size_mm.x / kStep_mm) + 1),
        height(static_cast<int>(target.size_mm.y / kStep_mm) + 1),
        grey(static_cast<size_t>(width) * height, 1.0f) {
    for (const Patch& patch : target.patches) {
      glm::dvec2 low = patch.outline_mm[0], high = low;
      for (const auto& p : patch.outline_mm) low = glm::min(low, p), high = glm::max(high, p);
      for (int y = std::max(0, static_cast<int>(low.y / kStep_mm)); y < height && y * kStep_mm <= high.y; ++y)
        for (int x = std::max(0, static_cast<int>(low.x / kStep_mm)); x < width && x * kStep_mm <= high.x; ++x)
          if (IsInside(patch.outline_mm, kStep_mm * glm::dvec2(x + 0.5, y + 0.5)))
            grey[static_cast<size_t>(y) * width + x] = static_cast<float>(patch.grey);
    }
  }
  double At(const glm::dvec2& at_mm) const {
    const int x = std::clamp(static_cast<int>(at_mm.x / kStep_mm), 0, width - 1);
    const int y = std::clamp(static_cast<int>(at_mm.y / kStep_mm), 0, height - 1);
    return grey[static_cast<size_t>(y) * width + x];
  }
};

}  // namespace

Image RenderTarget(const PrintedTarget& target, const glm::dvec2& target_origin_mm, const Camera& camera,
                   const RigidTransform& camera_from_board, const RenderedLight& light) {
  const Raster raster(target);
  const RigidTransform board_from_camera = camera_from_board.Inverse();
  const glm::dvec3 eye = board_from_camera.translation_mm;
  constexpr int kStrata = 4;  // blurred before pixels are averaged, as light is
  Image fine(kStrata * camera.width, kStrata * camera.height, 1);
  ParallelFor(fine.height, 0, [&](size_t y) {
    for (int x = 0; x < fine.width; ++x) {
      const glm::dvec2 pixel((x + 0.5) / kStrata, (static_cast<double>(y) + 0.5) / kStrata);
      const glm::dvec3 d = board_from_camera.Direction(DirectionFromPixel(camera, pixel));
      const double t = -eye.z / d.z;
      const glm::dvec2 at = glm::dvec2(eye + t * d) + target_origin_mm;
      const bool on_print = t > 0 && at.x >= 0 && at.y >= 0 && at.x <= target.size_mm.x && at.y <= target.size_mm.y;
      fine.at(x, static_cast<int>(y), 0) =
          static_cast<float>(light.level * (on_print ? 0.04 + 0.86 * raster.At(at) : light.surround));
    }
  });
  Image blurred = Blurred(fine, kStrata * light.sigma_px);
  if (light.wide_weight > 0) {
    const Image wide = Blurred(fine, kStrata * light.wide_sigma_px);
    for (size_t i = 0; i < blurred.values.size(); ++i)
      blurred.values[i] += static_cast<float>(light.wide_weight) * (wide.values[i] - blurred.values[i]);
  }
  Image image(camera.width, camera.height, 1);
  double mean = 0;
  for (int y = 0; y < fine.height; ++y)
    for (int x = 0; x < fine.width; ++x) {
      image.at(x / kStrata, y / kStrata, 0) += blurred.at(x, y, 0) / (kStrata * kStrata);
      mean += fine.at(x, y, 0) / static_cast<double>(fine.values.size());
    }
  for (float& v : image.values) v += static_cast<float>(light.veiling_glare * (mean - v));
  return Noisy(image, light.gain, light.read_noise, light.seed);
}

Image Blurred(const Image& image, double sigma_px) {
  if (sigma_px <= 0) return image;
  const int radius = static_cast<int>(std::ceil(5 * sigma_px));
  std::vector<double> kernel;
  double total = 0;
  for (int i = -radius; i <= radius; ++i) total += kernel.emplace_back(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
  Image across = image, both = image;
  for (int pass = 0; pass < 2; ++pass) {
    const Image& from = pass ? across : image;
    Image& to = pass ? both : across;
    ParallelFor(image.height, 0, [&](size_t row) {
      const int y = static_cast<int>(row);
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < image.channels; ++c) {
          double sum = 0;
          for (int i = -radius; i <= radius; ++i)
            sum += kernel[i + radius] * from.at(pass ? x : std::clamp(x + i, 0, image.width - 1),
                                                pass ? std::clamp(y + i, 0, image.height - 1) : y, c);
          to.at(x, y, c) = static_cast<float>(sum / total);
        }
    });
  }
  return both;
}

Image Noisy(const Image& image, double gain, double read_noise, uint64_t seed) {
  Image noisy = image;
  for (size_t i = 0; i < noisy.values.size(); ++i) {
    const double stddev = std::sqrt(std::max(0.0, gain * image.values[i]) + read_noise * read_noise);
    noisy.values[i] += static_cast<float>(stddev * Gaussian(Key(seed), i));
  }
  return noisy;
}

RigidTransform LookingAt(const glm::dvec3& aim_mm, double distance_mm, double tilt_deg, double azimuth_deg,
                         double roll_deg) {
  const double rad = std::numbers::pi / 180.0, t = tilt_deg * rad, a = azimuth_deg * rad, r = roll_deg * rad;
  const glm::dvec3 axis(-std::sin(a), std::cos(a), 0.0);
  const auto turned = [&](const glm::dvec3& v) {
    return v * std::cos(t) + glm::cross(axis, v) * std::sin(t) + axis * glm::dot(axis, v) * (1 - std::cos(t));
  };
  const glm::dmat3 roll({std::cos(r), std::sin(r), 0}, {-std::sin(r), std::cos(r), 0}, {0, 0, 1});
  const glm::dmat3 tilt(turned({1, 0, 0}), turned({0, 1, 0}), turned({0, 0, 1}));
  const glm::dmat3 rotation = roll * tilt;
  return {rotation, glm::dvec3(0, 0, distance_mm) - rotation * aim_mm};
}

}  // namespace crownfit
