#include "fit_path/walked_step.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/linear_algebra.h"

namespace crownfit {

Eigen::MatrixXd CovarianceOf(const PixelEstimate& pixel) {
  const int channels = pixel.mean.size();
  Eigen::MatrixXd m(channels, channels);
  for (int a = 0; a < channels; ++a)
    for (int b = 0; b < channels; ++b) m(a, b) = pixel.covariance[PairOf(a, b, channels)];
  return m;
}

RowsOfSlopes::RowsOfSlopes(const std::vector<Run>& runs, const SlopeChain& chain, int unknowns)
    : unknowns_(unknowns), groups_(0) {
  Check(!runs.empty(), "slopes");
  groups_ = runs[0].derivatives->groups();
  channels_ = runs[0].derivatives->channels();
  std::map<std::pair<size_t, Quantity>, double> sum;
  for (const Run& r : runs) {
    Check(r.derivatives->groups() == groups_, "runs of as many groups");
    for (const DerivativeParameter& p : r.derivatives->parameters())
      if (r.tells(p)) sum[{p.layer, p.quantity}] += r.weight;
  }
  for (const Run& r : runs)
    for (size_t j = 0; j < r.derivatives->parameters().size(); ++j) {
      const DerivativeParameter& p = r.derivatives->parameters()[j];
      for (int c = 0; c < channels_ && r.tells(p); ++c)
        if (const Eigen::RowVectorXd row = chain(p, c); row.size() > 0 && !row.isZero())
          entries_.push_back({r.derivatives, j, c, r.weight / sum[{p.layer, p.quantity}] * row});
    }
}

WalkedRows RowsOfSlopes::Zero(int exact) const {
  const WalkedRows::Rows zero = WalkedRows::Rows::Zero(channels_, unknowns_);
  return {zero, std::vector<WalkedRows::Rows>(groups_, zero), WalkedRows::Rows::Zero(channels_, exact)};
}

void RowsOfSlopes::AddTo(WalkedRows& rows, size_t pixel, double weight) const {
  for (const Entry& e : entries_) {
    const double brightness = weight * e.derivatives->brightness(e.channel, pixel);
    rows.all.row(e.channel) += brightness * e.derivatives->At(e.parameter, e.channel, pixel) * e.chain;
    const std::vector<double> some = e.derivatives->Without(e.parameter, e.channel, pixel);
    for (size_t g = 0; g < some.size(); ++g) rows.without[g].row(e.channel) += brightness * some[g] * e.chain;
  }
}

WalkedStep::WalkedStep(int of_slopes, int groups, int exact)
    : unknowns_(of_slopes + exact),
      of_slopes_(of_slopes),
      normal_(Eigen::MatrixXd::Zero(unknowns_, unknowns_)),
      noise_(normal_),
      of_walks_(normal_),
      of_own_walks_(normal_),
      right_(Eigen::VectorXd::Zero(unknowns_)),
      normal_without_(groups, Eigen::MatrixXd::Zero(of_slopes, unknowns_)),
      right_without_(groups, Eigen::VectorXd::Zero(of_slopes)) {}

void WalkedStep::Add(const Pixel& pixel, WalkedRows rows) {
  const size_t groups = normal_without_.size();
  Check(rows.without.size() == groups, "photographs of as many groups of paths");
  const Eigen::LLT<Eigen::MatrixXd> root(pixel.covariance);
  Check(root.info() == Eigen::Success, "a covariance with an inverse");
  const auto whiten = [&](auto& m) { root.matrixL().solveInPlace(m); };
  Eigen::VectorXd residual = pixel.residual;
  Eigen::MatrixXd of_walks = pixel.of_walks;
  if (of_walks.size() == 0) of_walks = Eigen::MatrixXd::Zero(residual.size(), residual.size());
  whiten(residual);
  whiten(of_walks);
  of_walks.transposeInPlace();
  whiten(of_walks);
  WalkedRows::Rows whole(pixel.residual.size(), unknowns_);
  whole << rows.all, rows.exact;
  whiten(whole);
  const auto all = whole.leftCols(of_slopes_), exact = whole.rightCols(unknowns_ - of_slopes_);
  normal_.noalias() += whole.transpose() * whole;
  const Eigen::MatrixXd walked = whole.transpose() * of_walks * whole;
  of_walks_ += walked;
  if (pixel.off_by_group.cols() == 0) {
    of_own_walks_ += walked;
  } else {
    WalkedRows::Rows off = pixel.off_by_group;
    whiten(off);
    if (right_off_.size() == 0) right_off_ = Eigen::MatrixXd::Zero(unknowns_, off.cols());
    right_off_.noalias() += whole.transpose() * off;
  }
  right_.noalias() += whole.transpose() * residual;
  const double n = static_cast<double>(groups);
  for (size_t g = 0; g < groups; ++g) {
    WalkedRows::Rows& some = rows.without[g];
    whiten(some);
    normal_without_[g].leftCols(of_slopes_).noalias() += some.transpose() * some;
    normal_without_[g].rightCols(unknowns_ - of_slopes_).noalias() += some.transpose() * exact;
    right_without_[g].noalias() += some.transpose() * residual;
    some -= all;
    noise_.topLeftCorner(of_slopes_, of_slopes_).noalias() += (n - 1.0) / n * some.transpose() * some;
  }
}

void WalkedStep::Add(const WalkedStep& other) {
  normal_ += other.normal_;
  noise_ += other.noise_;
  of_walks_ += other.of_walks_;
  of_own_walks_ += other.of_own_walks_;
  right_ += other.right_;
  if (right_off_.size() == 0)
    right_off_ = other.right_off_;
  else if (other.right_off_.size() > 0)
    right_off_ += other.right_off_;
  for (size_t g = 0; g < normal_without_.size(); ++g) {
    normal_without_[g] += other.normal_without_[g];
    right_without_[g] += other.right_without_[g];
  }
}

void WalkedStep::AddExact(const Eigen::VectorXd& residual, const Eigen::MatrixXd& derivatives) {
  const Eigen::MatrixXd normal = derivatives.transpose() * derivatives;
  const Eigen::VectorXd right = derivatives.transpose() * residual;
  normal_.topLeftCorner(of_slopes_, of_slopes_) += normal;
  right_.head(of_slopes_) += right;
  for (size_t g = 0; g < normal_without_.size(); ++g) {
    normal_without_[g].leftCols(of_slopes_) += normal;
    right_without_[g] += right;
  }
}

Eigen::MatrixXd WalkedStep::NormalWithout(size_t group) const {
  Eigen::MatrixXd normal = normal_;
  normal.topRows(of_slopes_) = normal_without_[group];
  normal.leftCols(of_slopes_) = normal_without_[group].transpose();
  normal.topLeftCorner(of_slopes_, of_slopes_) = normal_without_[group].leftCols(of_slopes_);
  return normal;
}

namespace {

Eigen::MatrixXd InverseOfScaled(const Eigen::MatrixXd& m, const Eigen::VectorXd& unit) {
  return InUnits(InverseOfSymmetric(InUnits(m, unit)), unit);
}

}  // namespace

WalkedStep::Solution WalkedStep::Solve(const Prior& prior, const std::vector<int>& held, Noise noise) const {
  Check(prior.precision.rows() == unknowns_ && prior.precision.cols() == unknowns_ && prior.pull.size() == unknowns_,
        "a prior of all unknowns");
  constexpr double kTold = 1.5;      // standard deviations: of the square of a slope, whose own are twice as many
  constexpr double kNothing = 1e-9;  // of what is known of an unknown anyway
  const auto groups = static_cast<Eigen::Index>(normal_without_.size());
  const double jackknife = static_cast<double>(groups - 1) / static_cast<double>(groups);
  const Eigen::MatrixXd normal = noise == Noise::kTakenOff ? Eigen::MatrixXd(normal_ - noise_) : normal_;

  std::vector<Eigen::MatrixXd> normal_by_group;  // of the groups, from their mean
  Eigen::MatrixXd right_by_group(unknowns_, groups), normal_mean = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
  for (Eigen::Index g = 0; g < groups; ++g) {
    normal_by_group.push_back(NormalWithout(static_cast<size_t>(g)));
    normal_mean += normal_by_group.back() / static_cast<double>(groups);
    right_by_group.col(g) << right_without_[static_cast<size_t>(g)], right_.tail(unknowns_ - of_slopes_);
  }
  right_by_group.colwise() -= right_by_group.rowwise().mean().eval();
  for (Eigen::MatrixXd& off : normal_by_group) off -= normal_mean;

  // In units of what the pixels say about each unknown alone; those held say nothing.
  const Eigen::VectorXd all_units = (normal_.diagonal() + prior.precision.diagonal()).unaryExpr([](double v) {
    return v > 0 ? 1.0 / std::sqrt(v) : 1.0;
  });
  std::vector<int> asked;
  std::vector<int> told, loose;
  for (int k = 0; k < unknowns_; ++k) {
    if (std::count(held.begin(), held.end(), k)) continue;
    asked.push_back(k);
    (normal(k, k) > 0 ? told : loose).push_back(k);
  }
  // Along some direction derivatives may tell no better than noise would. The unknown that it is mostly made of is then
  // known from the prior alone, and the others as they follow it.
  Eigen::MatrixXd inverse_told;
  while (true) {
    const Eigen::VectorXd unit = all_units(told);
    const auto scaled = [&](const Eigen::MatrixXd& m) -> Eigen::MatrixXd {
      const Eigen::MatrixXd part = m(told, told);
      return InUnits(0.5 * (part + part.transpose()), unit);
    };
    const auto [values, directions] = EigenOfSymmetric(scaled(normal));
    Eigen::VectorXd variances = Eigen::VectorXd::Zero(values.size());
    for (const Eigen::MatrixXd& off : normal_by_group)
      variances += jackknife * Congruent(directions.transpose(), scaled(off)).diagonal().cwiseAbs2();
    Eigen::Index least = -1;
    double told_by = kTold;
    for (Eigen::Index i = 0; i < values.size(); ++i)
      if (const double by = values[i] > kNothing ? values[i] / std::sqrt(variances[i]) : -1.0; by <= told_by)
        least = i, told_by = by;
    if (least < 0) {
      inverse_told = InUnits(Congruent(directions, values.cwiseInverse().asDiagonal()), unit);
      break;
    }
    Eigen::Index most = 0;
    directions.col(least).cwiseAbs().maxCoeff(&most);
    loose.push_back(told[static_cast<size_t>(most)]);
    told.erase(told.begin() + most);
  }
  Eigen::MatrixXd project = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
  for (const int k : told) project(k, k) = 1.0;
  project(loose, told) = normal(loose, told) * inverse_told;
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
  const Eigen::MatrixXd with_prior = Congruent(project, normal) + prior.precision;
  inverse(asked, asked) = InverseOfScaled(with_prior(asked, asked), all_units(asked));
  const auto spread = [&](const Eigen::MatrixXd& m) { return Congruent(inverse * project, m); };

  Solution s;
  s.seen = loose.empty();
  s.step = inverse * (project * right_ + prior.pull);
  s.gain = s.step.dot(2.0 * right_ - normal * s.step);
  Eigen::MatrixXd off(unknowns_, groups);
  for (Eigen::Index g = 0; g < groups; ++g)
    off.col(g) = inverse * (project * (right_by_group.col(g) - normal_by_group[static_cast<size_t>(g)] * s.step));
  s.slope_covariance = jackknife * off * off.transpose();
  Eigen::MatrixXd of_walks = of_own_walks_;
  if (right_off_.size() > 0) {
    const double n = static_cast<double>(right_off_.cols());
    const Eigen::MatrixXd apart = right_off_.colwise() - right_off_.rowwise().mean();
    of_walks += apart * apart.transpose() / (n * (n - 1.0));
  }
  s.walk_covariance = spread(of_walks) + s.slope_covariance;
  s.covariance = spread(normal_ - of_walks_) + Congruent(inverse, prior.precision) + s.walk_covariance;
  s.noise_gain = (normal * s.covariance).trace();
  return s;
}

}  // namespace crownfit
