#pragma once
// Likelihood profiles: how much worse the photographs fit when one free entry is held away from its best value.

#include <vector>

#include "fit/image_residuals.h"

namespace crownfit {

struct LikelihoodProfile {
  enum class By { kParabola, kFits, kSlopes };  ///< the others were fitted again at every point; or its slope is known
  int entry = 0;                                ///< of the free parameters
  By by = By::kParabola;
  std::vector<double> at;          ///< ascending, in the entry's own scale
  std::vector<double> delta_chi2;  ///< above the smallest; priors included, over the variance inflation
};

/// Standard deviations to either side, somewhat beyond the 95 % interval.
inline constexpr double kProfileReach = 2.5;

/// Of chi2, by an entry held so far off the solution: its slope and its curvature there.
struct SlopeAt {
  double off, slope, curvature;
};
/// Chi2 at ten places to either side, between those where its slope is known: the integral of the cubic through
/// derivatives and curvatures (Hermite). `derivatives`: ascending, two or more.
LikelihoodProfile ProfileOfSlopes(const std::vector<SlopeAt>& derivatives);

/// Whether an entry's 95 % interval is wider than a factor 1.5.
bool IsWeak(const FreeEntry& entry, double best, double stddev);

/// What the covariance says: a parabola, to 2.5 standard deviations.
LikelihoodProfile QuadraticProfile(const FreeParameters& free, const Eigen::VectorXd& x,
                                   const Eigen::MatrixXd& covariance, int entry);

/// Fits everything else again with an entry held away from x. Derivatives are those at x (chord steps: Ortega and
/// Rheinboldt 1970, chapter 7), so a point costs one to three predictions; thicknesses keep the geometry of
/// `residuals`.
class Profiler {
 public:
  /// x: where a fit converged. All but x must outlive it.
  Profiler(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& x, double inflation,
           bool use_priors);
  /// At `points_a_side` values to either side, to 2.5 standard deviations of this chi2, at most of `stddev`.
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
