#include "calibration/edge_profile.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr double kHalf_px = 5.0, kStep_px = 0.5;
constexpr int kSamples = 21;

using Profile = Eigen::Matrix<double, kSamples, 1>;

std::optional<Profile> ProfileAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward) {
  const glm::dvec2 along(-outward.y, outward.x);
  const double margin = kHalf_px + 3.0;
  if (pixel.x < margin || pixel.y < margin || pixel.x > image.width - margin || pixel.y > image.height - margin)
    return std::nullopt;
  Profile profile = Profile::Zero();
  for (int i = 0; i < kSamples; ++i)
    for (int k = -2; k <= 2; ++k)
      for (int c = 0; c < image.channels; ++c)
        profile[i] += Bilinear(image, pixel + (kStep_px * i - kHalf_px) * outward + static_cast<double>(k) * along, c);
  return profile;
}

/// Coverage at distance d outside the edge of a blurred half plane.
double Inside(double d, double blur) { return 0.5 * std::erfc(d / (blur * std::sqrt(2.0))); }

struct StepFit {
  double place = 0, squares = HUGE_VAL, variance = HUGE_VAL, contrast = 0;
};

StepFit FitStep(const Profile& profile, double blur, double reach) {
  StepFit best;
  Eigen::Matrix<double, kSamples, 3> basis = Eigen::Matrix<double, kSamples, 3>::Zero(), best_basis = basis;
  Eigen::Vector3d best_levels = Eigen::Vector3d::Zero();
  const auto tried = static_cast<int>(2 * reach / 0.05);
  for (int t = 0; t <= tried; ++t) {
    const double place = 0.05 * t - reach;
    for (int i = 0; i < kSamples; ++i) {
      const double d = kStep_px * i - kHalf_px - place, inside = Inside(d, blur);
      basis.row(i) << 1.0, inside, std::min(0.0, d) * inside;
    }
    const Eigen::Vector3d levels = (basis.transpose() * basis).ldlt().solve(basis.transpose() * profile);
    const double squares = (profile - basis * levels).squaredNorm();
    if (squares < best.squares) {
      best.squares = squares;
      best.place = place;
      best_levels = levels;
      best_basis = basis;
    }
  }
  Eigen::Matrix<double, kSamples, 4> by_all;
  by_all.leftCols<3>() = best_basis;
  constexpr double kNudge = 0.02;
  for (int i = 0; i < kSamples; ++i) {
    const double d = kStep_px * i - kHalf_px - best.place;
    const auto model = [&](double at) {
      return Inside(at, blur) * (best_levels[1] + best_levels[2] * std::min(0.0, at));
    };
    by_all(i, 3) = (model(d - kNudge) - model(d + kNudge)) / (2 * kNudge);
  }
  // Samples at half pixels share pixels: an error of one extends over about four.
  const double noise = 4.0 * best.squares / (kSamples - 4);
  const Eigen::Matrix4d normal = by_all.transpose() * by_all;
  best.variance = noise * PseudoInverse(normal)(3, 3);
  best.contrast = std::abs(best_levels[1]) / std::sqrt(noise + 1e-300);
  return best;
}

}  // namespace

std::optional<EdgePlace> StepAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                    double blur_px, double reach_px) {
  const auto profile = ProfileAcross(image, pixel, outward);
  if (!profile) return std::nullopt;
  const StepFit fit = FitStep(*profile, blur_px, reach_px);
  if (!(fit.contrast > 4.0) || std::abs(fit.place) > reach_px - 0.1) return std::nullopt;
  return EdgePlace{fit.place, std::sqrt(fit.variance)};
}

std::optional<double> BlurAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                 double reach_px) {
  const auto profile = ProfileAcross(image, pixel, outward);
  if (!profile) return std::nullopt;
  StepFit best;
  double of_best = 0;
  for (const double blur : {0.4, 0.55, 0.7, 0.85, 1.0, 1.2, 1.5, 1.9, 2.4}) {
    const StepFit fit = FitStep(*profile, blur, reach_px);
    if (fit.squares < best.squares) best = fit, of_best = blur;
  }
  if (!(best.contrast > 10.0)) return std::nullopt;
  return of_best;
}

}  // namespace crownfit
