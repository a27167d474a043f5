#include "support/rendered_target.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

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

/// A grid of the printed patches, so that few are tested for each point.
class PrintedPatches {
 public:
  explicit PrintedPatches(const PrintedTarget& target)
      : patches_(target.patches),
        columns_(static_cast<int>(target.size_mm.x / kCell_mm) + 1),
        rows_(static_cast<int>(target.size_mm.y / kCell_mm) + 1),
        of_cell_(static_cast<size_t>(columns_) * rows_) {
    for (const Patch& patch : patches_) {
      glm::dvec2 low = patch.outline_mm[0], high = low;
      for (const auto& p : patch.outline_mm) low = glm::min(low, p), high = glm::max(high, p);
      const glm::ivec2 from = CellAt(low), to = CellAt(high);
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) of_cell_[static_cast<size_t>(y) * columns_ + x].push_back(&patch);
    }
  }
  /// Grey of the last patch printed there; 1 on bare paper.
  double GreyAt(const glm::dvec2& at_mm) const {
    const glm::ivec2 cell = CellAt(at_mm);
    const auto& here = of_cell_[static_cast<size_t>(cell.y) * columns_ + cell.x];
    const auto last = std::find_if(here.rbegin(), here.rend(), [&](auto p) { return IsInside(p->outline_mm, at_mm); });
    return last == here.rend() ? 1.0 : (*last)->grey;
  }

 private:
  static constexpr double kCell_mm = 1.0;
  glm::ivec2 CellAt(const glm::dvec2& at_mm) const {
    return glm::clamp(glm::ivec2(at_mm / kCell_mm), glm::ivec2(0), glm::ivec2(columns_ - 1, rows_ - 1));
  }
  const std::vector<Patch>& patches_;
  int columns_, rows_;
  std::vector<std::vector<const Patch*>> of_cell_;
};

}  // namespace

Image RenderTarget(const PrintedTarget& target, const glm::dvec2& target_origin_mm, const Camera& camera,
                   const RigidTransform& camera_from_board, const RenderedLight& light) {
  const PrintedPatches patches(target);
  const RigidTransform board_from_camera = camera_from_board.Inverse();
  const glm::dvec3 eye = board_from_camera.translation_mm;
  // The lens is inverted only at pixel corners; within a pixel, directions change linearly.
  const int corners = camera.width + 1;
  std::vector<glm::dvec3> at_corner(static_cast<size_t>(corners) * (camera.height + 1));
  ParallelFor(camera.height + 1, 0, [&](size_t y) {
    for (int x = 0; x < corners; ++x)
      at_corner[y * corners + x] = board_from_camera.Direction(DirectionFromPixel(camera, {x, static_cast<double>(y)}));
  });
  constexpr int kStrata = 4;  // blurred before pixels are averaged, as light is
  Image fine(kStrata * camera.width, kStrata * camera.height, 1);
  ParallelFor(fine.height, 0, [&](size_t y) {
    for (int x = 0; x < fine.width; ++x) {
      const glm::dvec3* above = &at_corner[y / kStrata * corners + x / kStrata];
      const double right = (x % kStrata + 0.5) / kStrata, down = (static_cast<double>(y % kStrata) + 0.5) / kStrata;
      const glm::dvec3 d =
          glm::mix(glm::mix(above[0], above[1], right), glm::mix(above[corners], above[corners + 1], right), down);
      const double t = -eye.z / d.z;
      const glm::dvec2 at = glm::dvec2(eye + t * d) + target_origin_mm;
      const bool on_print = t > 0 && at.x >= 0 && at.y >= 0 && at.x <= target.size_mm.x && at.y <= target.size_mm.y;
      fine.at(x, static_cast<int>(y), 0) =
          static_cast<float>(light.level * (on_print ? 0.04 + 0.86 * patches.GreyAt(at) : light.surround));
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
  Image blurred = image;
  cv::Mat values(blurred.height, blurred.width, CV_32FC(blurred.channels), blurred.values.data());
  const int side = 2 * static_cast<int>(std::ceil(5 * sigma_px)) + 1;
  cv::GaussianBlur(values, values, {side, side}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  return blurred;
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
