#include "photograph_flow.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/linear_algebra.h"
#include "base/parallel.h"
#include "fit_pixels.h"
#include "forward/predict.h"

namespace crownfit {
namespace {

/// How a value changes to the right and downwards: a weighted sum over pixels of the cast.
struct Part {
  int pixel;
  glm::dvec2 weight;
};
using Gradient = std::vector<Part>;

/// Pixels of a photograph that lie wholly on the object, by their place.
class PixelsOnObject {
 public:
  PixelsOnObject(const PhotographCast& cast, const Photograph& photo)
      : width_(photo.linear.width), height_(photo.linear.height), cast_(cast), at_(photo.usable.size(), kNone) {
    for (size_t k = 0; k < cast.pixels.size(); ++k)
      if (const PixelCast& pixel = cast.pixels[k]; !pixel.at_silhouette && IsUsable(photo, pixel))
        at_[static_cast<size_t>(pixel.y) * width_ + pixel.x] = static_cast<int>(k);
  }

  /// Of the plane through the neighbours of a pixel of the cast; empty where those do not tell one.
  Gradient Around(int pixel) const {
    constexpr int kReach = 4;
    constexpr double kWidth = 1.5;  // pixels
    constexpr size_t kFew = 8;
    const PixelCast& here = cast_.pixels[pixel];
    std::vector<std::pair<int, Eigen::Vector3d>> neighbours;
    std::vector<double> weights;
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    for (int y = std::max(0, here.y - kReach); y <= std::min(height_ - 1, here.y + kReach); ++y)
      for (int x = std::max(0, here.x - kReach); x <= std::min(width_ - 1, here.x + kReach); ++x) {
        const int k = at_[static_cast<size_t>(y) * width_ + x];
        if (k == kNone || k == pixel) continue;
        const Eigen::Vector3d place(1.0, x - here.x, y - here.y);
        const double weight = std::exp(-place.tail<2>().squaredNorm() / (2.0 * kWidth * kWidth));
        normal += weight * place * place.transpose();
        neighbours.emplace_back(k, place);
        weights.push_back(weight);
      }
    Gradient gradient;
    constexpr double kFlat = 1e-3;  // determinant over trace^3; 0.03 with all neighbours
    if (neighbours.size() < kFew || EigenOfSymmetric(normal).values.prod() < kFlat * std::pow(normal.trace(), 3))
      return gradient;
    const Eigen::Matrix3d inverse = InverseOfSymmetric(normal);
    for (size_t n = 0; n < neighbours.size(); ++n) {
      const Eigen::Vector3d plane = weights[n] * inverse * neighbours[n].second;
      gradient.push_back({neighbours[n].first, {plane[1], plane[2]}});
    }
    return gradient;
  }

 private:
  static constexpr int kNone = -1;
  int width_, height_;
  const PhotographCast& cast_;
  std::vector<int> at_;
};

/// Which way, in pixels per standard deviation, a pose error moves what a pixel of the cast shows.
glm::dvec2 WayOf(const Crown& crown, const PixelCast& pixel, const Camera& camera, const RigidTransform& low,
                 const RigidTransform& high) {
  glm::dvec3 point(0.0);
  for (int k = 0; k < 3; ++k)
    point += static_cast<double>(pixel.at.weights[k]) * crown.fine.vertices[pixel.at.vertices[k]];
  const auto from = PixelFromPoint(camera, low.Point(point)), to = PixelFromPoint(camera, high.Point(point));
  return from && to ? *to - *from : glm::dvec2(0.0);
}

}  // namespace

void TakePhotographsOwnGradients(const FitProblem& problem, const CrownInput& input, FitState& at) {
  const std::vector<CalibrationError>& errors = problem.errors;
  const Material material = MaterialAt(problem.free, at.x);
  for (size_t g = 0; g < at.pixels.size(); ++g) {
    const FitPixels& p = at.pixels[g];
    CalibrationSlopes& of = at.calibration.slopes[g];
    const PhotographCast& cast = at.cast.photographs[p.photograph];
    const Photograph& photo = input.photographs[p.photograph];
    const Camera& camera = input.capture.photographs[p.photograph].camera;
    std::vector<std::pair<RigidTransform, RigidTransform>> poses;  // per error: half a standard deviation to each side
    for (const int e : of.errors) {
      std::vector<double> amounts(errors.size(), 0.0);
      const auto pose = [&](double amount) {
        amounts[e] = amount;
        return Moved(input.capture, errors, amounts).photographs[p.photograph].camera_from_object;
      };
      poses.emplace_back(pose(-0.5), pose(0.5));
    }
    const PixelsOnObject on_object(cast, photo);
    const std::vector<glm::dvec3> shaded =
        PredictPixels(input.capture, at.cast, p.photograph, material, at.scales.light, problem.options.threads);
    of.of_photograph.setZero(of.by_error.rows(), of.by_error.cols());
    ParallelFor(p.pixels.size(), problem.options.threads, [&](size_t i) {
      const PixelCast& here = cast.pixels[p.pixels[i]];
      const Gradient gradient = on_object.Around(p.pixels[i]);
      if (gradient.empty() || !here.at.exists()) return;
      glm::dvec2 seen[kChannels] = {}, by_shader[kChannels] = {};
      double variance[kChannels] = {};
      for (const auto& [k, weight] : gradient) {
        const PixelCast& near = cast.pixels[k];
        for (int c = 0; c < kChannels; ++c) {
          seen[c] += weight * static_cast<double>(photo.linear.at(near.x, near.y, c));
          by_shader[c] += weight * shaded[k][c];
          variance[c] += glm::dot(weight, weight) * photo.variance.at(near.x, near.y, c);
        }
      }
      for (size_t e = 0; e < of.errors.size(); ++e) {
        if (errors[of.errors[e]].light) continue;
        const glm::dvec2 way = WayOf(*at.cast.crown, here, camera, poses[e].first, poses[e].second);
        for (int c = 0; c < kChannels; ++c) {
          const double square = glm::dot(seen[c], seen[c]);
          const double sure = square > 0 ? std::max(0.0, 1.0 - variance[c] / square) : 0.0;
          const auto row = kChannels * static_cast<Eigen::Index>(i) + c;
          const auto column = static_cast<Eigen::Index>(e);
          of.of_photograph(row, column) = -sure * glm::dot(seen[c], way);
          of.by_error(row, column) += sure * glm::dot(by_shader[c], way);
        }
      }
    });
  }
}

}  // namespace crownfit
