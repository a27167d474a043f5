#include "fit_path/walk_runs.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/linear_algebra.h"

namespace crownfit {

void WalkRuns::Add(RunEstimate run) {
  constexpr size_t kSeveral = 3;
  const bool leads_on = run.is_on_its_way || (!runs_.empty() && runs_.back().is_on_its_way);
  if (run.is_on_its_way && runs_.size() >= kSeveral && !has_strayed_) {
    // It strays from several that had arrived: bad luck with its derivatives, which a second one has not.
    has_strayed_ = true;
    return;
  }
  if (leads_on) runs_.clear();
  runs_.push_back(std::move(run));
  // Those whose derivatives were too noisy to tell what later ones, which know those of several runs, do.
  if (runs_.back().tells_all) std::erase_if(runs_, [](const RunEstimate& e) { return !e.tells_all; });
}

bool WalkRuns::Conclude() {
  constexpr double kAgreeAtOnce = 2.0, kAgree = 5.0;  // mean square of scatter in standard deviations of the walks
  constexpr size_t kSeveral = 4;
  constexpr double kOfUnknown = 0.1;  // of the variance
  const double paths = Paths();
  const int m = unknowns_.material(), count = unknowns_.count();
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(count);
  Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(count, count), whole_of_a_run = whole;
  DataEstimate k;
  k.by_photographs = Eigen::VectorXd::Zero(m);
  at_.walked.clear();
  for (const auto& values : runs_[0].values) at_.walked.emplace_back(values.size());
  // Values are walked anew in every run; derivatives, in the last one, are the mean of all runs'.
  const Eigen::MatrixXd &of_slopes = runs_.back().of_slopes, &of_model = runs_.back().of_model;
  Eigen::MatrixXd of_mean = of_slopes;
  for (const RunEstimate& e : runs_) {
    const double share = e.paths / paths;  // the noise of walks goes with their number, and is all that runs differ by
    mean += share * e.unknowns;
    k.by_photographs += share * e.by_photographs;
    whole += share * e.covariance;
    whole_of_a_run += share * e.of_walks;
    of_mean += share * share * (e.of_walks - of_slopes);
    k.reduced_chi2 += share * e.chi2;
    k.block_chi2 += share * e.misfit.patches.chi2;
    for (size_t g = 0; g < at_.walked.size(); ++g)
      for (size_t i = 0; i < at_.walked[g].size(); ++i) at_.walked[g][i] += share * e.values[g][i];
  }
  std::vector<ResidualChi2> left;
  for (const RunEstimate& e : runs_) left.push_back(e.misfit);
  at_.residual_chi2 = MeanOf(left);
  at_.residual_chi2_of.clear();
  for (size_t g = 0; g < runs_[0].misfit_of.size(); ++g) {
    left.clear();
    for (const RunEstimate& e : runs_) left.push_back(e.misfit_of[g]);
    at_.residual_chi2_of.push_back(MeanOf(left));
  }
  const Eigen::MatrixXd covariance = whole.topLeftCorner(m, m), of_a_run = whole_of_a_run.topLeftCorner(m, m);
  double off = 0;
  for (const RunEstimate& e : runs_) {
    const Eigen::VectorXd own = e.of_walks.diagonal().head(m),
                          allowed = own.cwiseMax(kOfUnknown * covariance.diagonal()).cwiseMax(1e-12);
    off += (e.unknowns - mean).head(m).cwiseAbs2().cwiseQuotient(allowed).sum();
  }
  const double moving = static_cast<double>(m) - static_cast<double>(unknowns_.Untold().size());
  const double scatter = runs_.size() > 1 && moving > 0 ? off / (moving * static_cast<double>(runs_.size() - 1)) : 0.0;
  const Eigen::MatrixXd whole_of_walks = std::max(1.0, scatter) * of_mean;
  const Eigen::MatrixXd of_walks = whole_of_walks.topLeftCorner(m, m);
  unknowns_.GoTo(mean);
  // What is left beyond noise is common to all runs: no number of walks averages it out. It is measured against the
  // noise of one run, photographs and walks.
  k.inflation = std::max(1.0, k.block_chi2);
  if (at_.residual_chi2.regions.IsMoreThan(k.inflation)) k.inflation = at_.residual_chi2.regions.chi2;
  const auto [variances, directions] = EigenOfSymmetric(covariance - of_a_run);
  const Eigen::MatrixXd of_photographs = directions * variances.cwiseMax(0.0).asDiagonal() * directions.transpose();
  k.covariance =
      of_photographs + (k.inflation - 1.0) * (of_photographs + of_a_run) + of_walks + of_model.topLeftCorner(m, m);
  // Rivals and the model's offset, below, are known of the material alone.
  const Eigen::VectorXd variance = (whole - whole_of_a_run).diagonal().cwiseMax(0.0) +
                                   (k.inflation - 1.0) * whole.diagonal() +
                                   (whole_of_walks + of_model).diagonal().cwiseMax(0.0);
  k.scales_stddev = unknowns_.ScalesOf(variance.cwiseSqrt());
  for (const Eigen::VectorXd& rival : rivals_)
    k.covariance += rival * rival.transpose() / static_cast<double>(rivals_.size());
  if (model_offset_.size() > 0) k.covariance += model_offset_ * model_offset_.transpose();
  ForgetRanges(of_photographs + of_walks, k);
  k.of_walks = of_walks.diagonal().cwiseQuotient(k.covariance.diagonal().cwiseMax(1e-300)).cwiseMin(1.0);
  for (Eigen::Index u = 0; u < k.unseen.cols(); ++u) k.of_walks -= k.of_walks.cwiseProduct(k.unseen.col(u));
  const Eigen::VectorXd all = EigenOfSymmetric(k.covariance).values;  // 0 where nothing is seen
  if (const auto unseen = k.unseen.cols(); unseen < m) k.condition = std::sqrt(all[m - 1] / all[unseen]);
  at_.knowledge = k;
  return runs_.size() > 1 && scatter <= (runs_.size() < kSeveral ? kAgreeAtOnce : kAgree);
}

double WalkRuns::Paths() const {
  return std::accumulate(runs_.begin(), runs_.end(), 0.0,
                         [](double sum, const RunEstimate& e) { return sum + e.paths; });
}

double WalkRuns::PathsWanted() const {
  constexpr double kOfRest = 0.5, kTold = 0.35, kPrecise = 0.01;  // in ln
  double times = 1.0;
  for (int k = 0; k < unknowns_.material(); ++k) {
    const double variance = at_.knowledge.covariance(k, k), of_walks = at_.knowledge.of_walks[k] * variance,
                 rest = variance - of_walks;
    if (!(of_walks > 0) || rest > kTold * kTold) continue;
    times = std::max(times, of_walks / std::max(kOfRest * rest, kPrecise * kPrecise - rest));
  }
  return (times - 1.0) * Paths();
}

/// Entries of which pictures know no more than their range does were not seen, nor were those without derivatives.
/// What the others owe to the range of such a one stays in their variances.
void WalkRuns::ForgetRanges(const Eigen::MatrixXd& known, DataEstimate& k) const {
  constexpr double kNoMore = 0.5;  // of the range's variance
  const int m = unknowns_.material();
  const Eigen::VectorXd of_range = unknowns_.RangesAlone().precision.diagonal().head(m).cwiseInverse();
  std::vector<int> unseen = unknowns_.Untold();
  for (int i = 0; i < m; ++i)
    if (known(i, i) > kNoMore * of_range[i] && !std::count(unseen.begin(), unseen.end(), i)) unseen.push_back(i);
  k.unseen = Eigen::MatrixXd::Zero(m, static_cast<Eigen::Index>(unseen.size()));
  for (size_t u = 0; u < unseen.size(); ++u) {
    k.unseen(unseen[u], static_cast<Eigen::Index>(u)) = 1.0;
    k.covariance.row(unseen[u]).setZero();
    k.covariance.col(unseen[u]).setZero();
  }
}

}  // namespace crownfit
