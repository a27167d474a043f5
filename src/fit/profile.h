#pragma once
// Likelihood profiles: the increase of chi2 when one free entry is held away from its best value.

#include <vector>

#include "fit/image_residuals.h"

namespace crownfit {

struct LikelihoodProfile {
  enum class By { kParabola, kFits, kSlopes };  ///< fits: the others are refitted at every point; slopes: integrated
  int entry = 0;                                ///< index of the free parameter
  By by = By::kParabola;
  std::vector<double> at;          ///< ascending, in the entry's own scale
  std::vector<double> delta_chi2;  ///< above the smallest; priors included, over the variance inflation
};

/// Standard deviations to either side, somewhat beyond the 95 % interval.
inline constexpr double kProfileReach = 2.5;

/// Slope and curvature of chi2 along an entry that is held at offset `off` from the solution.
struct SlopeAt {
  double off, slope, curvature;
};
/// Chi2 at ten points per side, between offsets with known slope: the integral of the cubic through slopes and
/// curvatures (Hermite). `derivatives`: ascending, two or more.
LikelihoodProfile ProfileOfSlopes(const std::vector<SlopeAt>& derivatives);

/// Whether an entry's 95 % interval is wider than a factor 1.5.
bool IsWeak(const FreeEntry& entry, double best, double stddev);

/// The parabola of the covariance, to 2.5 standard deviations.
LikelihoodProfile QuadraticProfile(const FreeParameters& free, const Eigen::VectorXd& x,
                                   const Eigen::MatrixXd& covariance, int entry);

/// Refits all other entries with one held away from x. Derivatives are those at x (chord steps: Ortega and Rheinboldt
/// 1970, chapter 7), so a point costs one to three predictions. Thicknesses keep the geometry of `residuals`.
class Profiler {
 public:
  /// x: where a fit converged. All arguments but x must outlive it.
  Profiler(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& x, double inflation,
           bool use_priors);
  /// With `points_a_side` points per side, to 2.5 standard deviations of this chi2, or of `stddev` if that is smaller.
  LikelihoodProfile Of(int entry, double stddev, int points_a_side) const;

 private:
  double Chi2At(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) const;
  double SmallestChi2(Eigen::VectorXd x, int held) const;

  const ImageResiduals& residuals_;
  const FreeParameters& free_;
  Eigen::VectorXd x_;
  double inflation_;
  Eigen::VectorXd prior_precision_;
  Eigen::MatrixXd jacobian_, normal_;
};

}  // namespace crownfit
