#include "fit/profile.h"

#include <algorithm>
#include <cmath>

#include "base/linear_algebra.h"

namespace crownfit {
namespace {

constexpr int kDrawn = 10;  // points per side, where not every point is a fit

void StartAtLeast(LikelihoodProfile& profile) {
  const double least = *std::min_element(profile.delta_chi2.begin(), profile.delta_chi2.end());
  for (double& chi2 : profile.delta_chi2) chi2 -= least;
}

}  // namespace

bool IsWeak(const FreeEntry& entry, double best, double stddev) {
  constexpr double kZ95 = 1.959963984540054, kFactor = 1.5;
  if (entry.scale == Scale::kLog) return 2 * kZ95 * stddev > std::log(kFactor);
  return best + kZ95 * stddev > kFactor * (best - kZ95 * stddev);
}

LikelihoodProfile QuadraticProfile(const FreeParameters& free, const Eigen::VectorXd& x,
                                   const Eigen::MatrixXd& covariance, int entry) {
  LikelihoodProfile profile{entry, LikelihoodProfile::By::kParabola, {}, {}};
  for (int i = -kDrawn; i <= kDrawn; ++i) {
    const double off = kProfileReach * i / kDrawn, value = x[entry] + off * std::sqrt(covariance(entry, entry));
    if (value < free.entries[entry].low || value > free.entries[entry].high) continue;
    profile.at.push_back(value);
    profile.delta_chi2.push_back(off * off);
  }
  return profile;
}

LikelihoodProfile ProfileOfSlopes(const std::vector<SlopeAt>& derivatives) {
  LikelihoodProfile profile{0, LikelihoodProfile::By::kSlopes, {derivatives.front().off}, {0.0}};
  for (size_t i = 1; i < derivatives.size(); ++i) {
    const auto& [from, slope, curvature] = derivatives[i - 1];
    const auto& [to, slope_to, curvature_to] = derivatives[i];
    const double width = to - from, begun = profile.delta_chi2.back();
    const int places = 2 * kDrawn / static_cast<int>(derivatives.size() - 1);
    for (int k = 1; k <= places; ++k) {
      const double t = static_cast<double>(k) / places, t2 = t * t, t3 = t2 * t, t4 = t2 * t2;
      const double of_slopes = slope * (t - t3 + 0.5 * t4) + slope_to * (t3 - 0.5 * t4),
                   of_curvatures =
                       curvature * (0.5 * t2 - 2.0 / 3.0 * t3 + 0.25 * t4) + curvature_to * (0.25 * t4 - t3 / 3.0);
      profile.at.push_back(from + t * width);
      profile.delta_chi2.push_back(begun + width * (of_slopes + width * of_curvatures));
    }
  }
  StartAtLeast(profile);
  return profile;
}

Profiler::Profiler(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& x,
                   double inflation, bool use_priors)
    : residuals_(residuals), free_(free), x_(x), inflation_(inflation), prior_precision_(free.count()) {
  for (int k = 0; k < free.count(); ++k)
    prior_precision_[k] = use_priors ? 1.0 / (free.entries[k].prior_stddev * free.entries[k].prior_stddev) : 0.0;
  jacobian_ = residuals.Evaluate(x, true).jacobian;
  normal_ = jacobian_.transpose() * jacobian_;
  normal_.diagonal() += prior_precision_;
}

/// `gradient`: half the gradient, with the derivatives at x_.
double Profiler::Chi2At(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) const {
  const Evaluation e = residuals_.Evaluate(x, false);
  if (!e.finite) return HUGE_VAL;
  Eigen::VectorXd off(free_.count());
  for (int k = 0; k < free_.count(); ++k) off[k] = x[k] - free_.entries[k].prior_mean;
  gradient = jacobian_.transpose() * e.robust + prior_precision_.cwiseProduct(off);
  return e.robust.squaredNorm() + prior_precision_.dot(off.cwiseAbs2());
}

double Profiler::SmallestChi2(Eigen::VectorXd x, int held) const {
  constexpr int kMostSteps = 6;
  constexpr double kEnough = 0.05;  // tolerance, relative to the increase at one standard deviation
  Eigen::MatrixXd normal = normal_;
  normal.row(held).setZero();
  normal.col(held).setZero();
  normal(held, held) = 1.0;
  Eigen::VectorXd gradient;
  double smallest = Chi2At(x, gradient);
  for (int i = 0; i < kMostSteps && std::isfinite(smallest); ++i) {
    gradient[held] = 0.0;
    const Eigen::VectorXd step = SolveSymmetric(normal, gradient);
    if (step.dot(gradient) < kEnough * inflation_) break;
    x -= step;
    for (int k = 0; k < free_.count(); ++k)
      if (k != held) x[k] = std::clamp(x[k], free_.entries[k].low, free_.entries[k].high);
    const double chi2 = Chi2At(x, gradient);
    if (!(chi2 < smallest)) break;
    smallest = chi2;
  }
  return smallest;
}

LikelihoodProfile Profiler::Of(int entry, double stddev, int points_a_side) const {
  Eigen::VectorXd along = SolveSymmetric(normal_, Eigen::VectorXd::Unit(free_.count(), entry));
  if (!along.allFinite() || !(along[entry] > 0))  // an unidentified direction
    along = stddev * stddev * Eigen::VectorXd::Unit(free_.count(), entry);
  const double reach = kProfileReach * std::min(std::sqrt(inflation_ * along[entry]), stddev);
  LikelihoodProfile profile{entry, LikelihoodProfile::By::kFits, {}, {}};
  for (int i = -points_a_side; i <= points_a_side; ++i) {
    const double off = reach * i / points_a_side, value = x_[entry] + off;
    if (value < free_.entries[entry].low || value > free_.entries[entry].high) continue;
    Eigen::VectorXd start = x_ + off / along[entry] * along;  // the others' optimum in the linear model
    for (int k = 0; k < free_.count(); ++k)
      start[k] = std::clamp(start[k], free_.entries[k].low, free_.entries[k].high);
    profile.at.push_back(value);
    profile.delta_chi2.push_back(SmallestChi2(start, entry) / inflation_);
  }
  StartAtLeast(profile);
  return profile;
}

}  // namespace crownfit
