#include "fit/walked_step.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "base/error.h"
#include "base/linear_algebra.h"

namespace crownfit {

Eigen::Matrix3d CovarianceOf(const std::array<double, 6>& v) {
  Eigen::Matrix3d m;
  m << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
  return m;
}

RowsOfSlopes::RowsOfSlopes(const std::vector<Run>& runs, const SlopeChain& chain, int unknowns)
    : unknowns_(unknowns), groups_(0) {
  Check(!runs.empty(), "slopes");
  groups_ = runs[0].slopes->groups();
  std::map<std::pair<size_t, Quantity>, double> sum;
  for (const Run& r : runs) {
    Check(r.slopes->groups() == groups_, "runs of as many groups");
    for (const SlopeParameter& p : r.slopes->parameters())
      if (r.tells(p)) sum[{p.layer, p.quantity}] += r.weight;
  }
  for (const Run& r : runs)
    for (size_t j = 0; j < r.slopes->parameters().size(); ++j) {
      const SlopeParameter& p = r.slopes->parameters()[j];
      for (int c = 0; c < kChannels && r.tells(p); ++c)
        if (const Eigen::RowVectorXd row = chain(p, c); row.size() > 0 && !row.isZero())
          entries_.push_back({r.slopes, j, c, r.weight / sum[{p.layer, p.quantity}] * row});
    }
}

WalkedRows RowsOfSlopes::Zero(int exact) const {
  const WalkedRows::Rows zero = WalkedRows::Rows::Zero(kChannels, unknowns_);
  return {zero, std::vector<WalkedRows::Rows>(groups_, zero), WalkedRows::Rows::Zero(kChannels, exact)};
}

void RowsOfSlopes::AddTo(WalkedRows& rows, size_t pixel, double weight) const {
  for (const Entry& e : entries_) {
    const double brightness = weight * e.slopes->brightness(e.channel, pixel);
    rows.all.row(e.channel) += brightness * e.slopes->At(e.parameter, e.channel, pixel) * e.chain;
    const std::vector<double> some = e.slopes->Without(e.parameter, e.channel, pixel);
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
  const Eigen::LLT<Eigen::Matrix3d> root(pixel.covariance);
  Check(root.info() == Eigen::Success, "a covariance with an inverse");
  const auto whiten = [&](auto& m) { root.matrixL().solveInPlace(m); };
  Eigen::Vector3d residual = pixel.residual;
  Eigen::Matrix3d of_walks = pixel.of_walks;
  whiten(residual);
  whiten(of_walks);
  of_walks.transposeInPlace();
  whiten(of_walks);
  WalkedRows::Rows whole(kChannels, unknowns_);
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

WalkedStep::Solution WalkedStep::Solve(const Prior& prior, const std::vector<int>& held, Noise noise) const {
  Check(prior.precision.rows() == unknowns_ && prior.precision.cols() == unknowns_ && prior.pull.size() == unknowns_,
        "a prior of all unknowns");
  const double groups = static_cast<double>(normal_without_.size());
  const double taken_off = noise == Noise::kTakenOff ? 1.0 : 0.0;
  Solution s;
  // In units of what the pixels say about each unknown alone; what noise leaves of a direction is at least nothing.
  const Eigen::VectorXd unit = (normal_.diagonal() + prior.precision.diagonal()).unaryExpr([](double v) {
    return v > 0 ? 1.0 / std::sqrt(v) : 1.0;
  });
  const auto inverse_of = [&](const Eigen::MatrixXd& normal, bool* seen) {
    Eigen::MatrixXd scaled = unit.asDiagonal() * normal * unit.asDiagonal();
    for (const int k : held) {
      scaled.row(k).setZero();
      scaled.col(k).setZero();
    }
    const auto [values, vectors] = EigenOfSymmetric(0.5 * (scaled + scaled.transpose()));
    if (seen) *seen = values.minCoeff() > 0 || !held.empty();
    const Eigen::MatrixXd positive = vectors * values.cwiseMax(0.0).asDiagonal() * vectors.transpose();
    Eigen::MatrixXd with_prior = positive + unit.asDiagonal() * prior.precision * unit.asDiagonal();
    for (const int k : held) {
      with_prior.row(k).setZero();
      with_prior.col(k).setZero();
      with_prior(k, k) = 1.0;
    }
    Eigen::MatrixXd inverse = InverseOfSymmetric(with_prior);
    for (const int k : held) {
      inverse.row(k).setZero();
      inverse.col(k).setZero();
    }
    return Eigen::MatrixXd(unit.asDiagonal() * inverse * unit.asDiagonal());
  };
  const Eigen::MatrixXd inverse = inverse_of(normal_ - taken_off * noise_, &s.seen);
  s.step = inverse * (right_ + prior.pull);
  s.gain = s.step.dot(2.0 * right_ - (normal_ - taken_off * noise_) * s.step);
  Eigen::MatrixXd steps(unknowns_, static_cast<Eigen::Index>(groups));
  for (size_t g = 0; g < normal_without_.size(); ++g) {
    Eigen::MatrixXd normal = normal_;
    normal.topRows(of_slopes_) = normal_without_[g];
    normal.leftCols(of_slopes_) = normal_without_[g].transpose();
    normal.topLeftCorner(of_slopes_, of_slopes_) = normal_without_[g].leftCols(of_slopes_);
    Eigen::VectorXd right = right_;
    right.head(of_slopes_) = right_without_[g];
    steps.col(static_cast<Eigen::Index>(g)) =
        inverse_of(normal - taken_off * groups / (groups - 1.0) * noise_, nullptr) * (right + prior.pull);
  }
  const Eigen::MatrixXd off = steps.colwise() - steps.rowwise().mean();
  s.slope_covariance = (groups - 1.0) / groups * off * off.transpose();
  Eigen::MatrixXd of_walks = of_own_walks_;
  if (right_off_.size() > 0) {
    const double n = static_cast<double>(right_off_.cols());
    const Eigen::MatrixXd apart = right_off_.colwise() - right_off_.rowwise().mean();
    of_walks += apart * apart.transpose() / (n * (n - 1.0));
  }
  s.walk_covariance = inverse * of_walks * inverse + s.slope_covariance;
  const Eigen::MatrixXd known = normal_ - of_walks_ + prior.precision;
  s.covariance = inverse * known * inverse + s.walk_covariance;
  s.noise_gain = ((normal_ - taken_off * noise_) * s.covariance).trace();
  return s;
}

}  // namespace crownfit
