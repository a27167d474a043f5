#include "fit_path/photograph_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/linear_algebra.h"
#include "base/parallel.h"
#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "shader/predict.h"

namespace crownfit {
namespace {

/// How a value changes to the right and downwards: a weighted sum over pixels of the cast.
struct Part {
  int pixel;
  glm::dvec2 weight;
};
using Gradient = std::vector<Part>;

/// Some pixels of a cast, by their place.
class PixelsByPlace {
 public:
  PixelsByPlace(const PhotographCast& cast, const std::vector<int>& pixels, int width, int height)
      : width_(width), height_(height), cast_(cast), at_(static_cast<size_t>(width) * height, kNone) {
    for (const int k : pixels) at_[static_cast<size_t>(cast.pixels[k].y) * width + cast.pixels[k].x] = k;
  }

  /// Of the parabola through the neighbours of a pixel of the cast (Savitzky and Golay 1964, here with Gaussian weights
  /// and without the pixel itself), or the plane where those do not tell one; empty where they do not tell that.
  Gradient Around(int pixel) const {
    constexpr int kReach = 4;
    constexpr double kWidth = 1.5;  // pixels
    const PixelCast& here = cast_.pixels[pixel];
    std::vector<int> neighbours;
    std::vector<double> weights;
    std::vector<Terms> terms;
    Eigen::Matrix<double, kParabola, kParabola> normal = Eigen::Matrix<double, kParabola, kParabola>::Zero();
    for (int y = std::max(0, here.y - kReach); y <= std::min(height_ - 1, here.y + kReach); ++y)
      for (int x = std::max(0, here.x - kReach); x <= std::min(width_ - 1, here.x + kReach); ++x) {
        const int k = at_[static_cast<size_t>(y) * width_ + x];
        if (k == kNone || k == pixel) continue;
        const double u = (x - here.x) / kWidth, v = (y - here.y) / kWidth;
        neighbours.push_back(k);
        weights.push_back(std::exp(-0.5 * (u * u + v * v)));
        terms.emplace_back(1.0, u, v, u * u, u * v, v * v);
        normal += weights.back() * terms.back() * terms.back().transpose();
      }
    for (const int count : {kParabola, kPlane}) {
      if (static_cast<int>(neighbours.size()) < 2 * count) continue;
      const auto [values, directions] = EigenOfSymmetric(normal.topLeftCorner(count, count));
      constexpr double kFlat = 0.01;  // least over largest; with all neighbours 0.1 of a parabola, 1 of a plane
      if (values[0] < kFlat * values[count - 1]) continue;
      const Eigen::MatrixXd of_terms =  // right and down
          directions.middleRows(1, 2) * values.cwiseInverse().asDiagonal() * directions.transpose() / kWidth;
      Gradient gradient;
      for (size_t n = 0; n < neighbours.size(); ++n) {
        const Eigen::Vector2d part = weights[n] * of_terms * terms[n].head(count);
        gradient.push_back({neighbours[n], {part[0], part[1]}});
      }
      return gradient;
    }
    return {};
  }

 private:
  static constexpr int kNone = -1, kPlane = 3, kParabola = 6;
  using Terms = Eigen::Vector<double, kParabola>;
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

/// Per channel, and the variance of either part.
struct PictureGradient {
  std::array<glm::dvec2, kMostChannels> slope{};
  std::array<double, kMostChannels> variance{};
};

/// `value` and `variance`: of a pixel of the cast and a channel.
template <class Value, class Variance>
PictureGradient GradientOf(const Gradient& parts, int channels, const Value& value, const Variance& variance) {
  PictureGradient g;
  for (const auto& [k, weight] : parts)
    for (int c = 0; c < channels; ++c) {
      g.slope[c] += weight * value(k, c);
      g.variance[c] += glm::dot(weight, weight) * variance(k, c);
    }
  return g;
}

/// Of two that are known independently.
PictureGradient Mean(const PictureGradient& a, const PictureGradient& b) {
  PictureGradient mean;
  for (int c = 0; c < kMostChannels; ++c) {
    const double share = a.variance[c] / std::max(a.variance[c] + b.variance[c], 1e-300);  // of b
    mean.slope[c] = (1.0 - share) * a.slope[c] + share * b.slope[c];
    mean.variance[c] = (1.0 - share) * a.variance[c];
  }
  return mean;
}

}  // namespace

KnownPicture MeanPicture(const FitPixels& p, double exposure, const std::vector<size_t>& ranks,
                         const std::vector<WalkedPicture>& walked) {
  double paths = 0;
  for (const WalkedPicture& w : walked) paths += w.paths;
  KnownPicture known;
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    Spectrum value = p.SceneryAt(i), variance(p.channels(), 0.0);
    for (const auto& [source, share] : p.TermsOf(i))
      for (const WalkedPicture& w : walked) {
        const PixelEstimate& pixel = (*w.pixels)[ranks[source]];
        const double weight = share * w.paths / paths;
        value += weight * pixel.mean;
        variance += weight * weight * pixel.variance();
      }
    known.values.push_back(exposure * value);
    known.variances.push_back(exposure * exposure * variance);
  }
  return known;
}

void TakeOwnGradients(const FitProblem& problem, const CrownInput& input, size_t number, const KnownPicture& walked,
                      FitState& at) {
  const std::vector<CalibrationError>& errors = problem.errors;
  const FitPixels& p = at.pixels[number];
  CalibrationDerivatives& of = at.calibration.derivatives[number];
  if (std::all_of(of.errors.begin(), of.errors.end(), [&](int e) { return errors[e].light.has_value(); })) return;
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
  std::vector<int> on_object, which(cast.pixels.size(), -1);  // pixels of the cast; where they are among the fit's
  for (size_t k = 0; k < cast.pixels.size(); ++k)
    if (!cast.pixels[k].at_silhouette && IsUsable(photo, cast.pixels[k])) on_object.push_back(static_cast<int>(k));
  for (size_t i = 0; i < p.pixels.size(); ++i) which[p.pixels[i]] = static_cast<int>(i);
  const PixelsByPlace photographed(cast, on_object, camera.width, camera.height),
      fitted(cast, p.pixels, camera.width, camera.height);
  const std::vector<Spectrum> shaded = PredictPixels(
      input.capture, at.cast, p.photograph, MaterialAt(problem.free, at.x), at.scales.light, problem.options.threads);
  of.of_photograph.setZero(of.by_error.rows(), of.by_error.cols());
  of.of_shader = of.of_photograph;
  ParallelFor(p.pixels.size(), problem.options.threads, [&](size_t i) {
    const PixelCast& here = cast.pixels[p.pixels[i]];
    const Gradient parts = photographed.Around(p.pixels[i]);
    if (parts.empty() || !here.at.exists()) return;
    PictureGradient seen = GradientOf(
        parts, p.channels(),
        [&](int k, int c) { return static_cast<double>(photo.linear.at(cast.pixels[k].x, cast.pixels[k].y, c)); },
        [&](int k, int c) { return photo.variance.at(cast.pixels[k].x, cast.pixels[k].y, c); });
    if (const Gradient near = fitted.Around(p.pixels[i]); !walked.values.empty() && !near.empty())
      seen = Mean(seen, GradientOf(
                            near, p.channels(), [&](int k, int c) { return walked.values[which[k]][c]; },
                            [&](int k, int c) { return walked.variances[which[k]][c]; }));
    const PictureGradient by_shader = GradientOf(
        parts, p.channels(), [&](int k, int c) { return shaded[k][c]; }, [](int, int) { return 0.0; });
    for (size_t e = 0; e < of.errors.size(); ++e) {
      if (errors[of.errors[e]].light) continue;
      const glm::dvec2 way = WayOf(*at.cast.crown, here, camera, poses[e].first, poses[e].second);
      for (int c = 0; c < p.channels(); ++c) {
        const double square = glm::dot(seen.slope[c], seen.slope[c]);
        const double sure = square > 0 ? std::max(0.0, 1.0 - seen.variance[c] / square) : 0.0;
        const auto row = p.channels() * static_cast<Eigen::Index>(i) + c;
        const auto column = static_cast<Eigen::Index>(e);
        of.of_photograph(row, column) = -sure * glm::dot(seen.slope[c], way);
        of.of_shader(row, column) = -sure * glm::dot(by_shader.slope[c], way);
      }
    }
  });
}

}  // namespace crownfit
