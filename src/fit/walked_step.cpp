#include "fit/walked_step.h"

#include <cmath>

#include "base/error.h"

namespace crownfit {

void WalkedStep::Add(const PooledSlopes& slopes, const UnknownOf& unknown_of, const std::vector<Pixel>& pixels) {
  const int groups = slopes.groups();
  if (normal_.size() == 0) {
    normal_ = noise_ = Eigen::MatrixXd::Zero(unknowns_, unknowns_);
    right_ = Eigen::VectorXd::Zero(unknowns_);
    normal_without_.assign(groups, normal_);
    right_without_.assign(groups, right_);
  }
  Check(normal_without_.size() == static_cast<size_t>(groups), "photographs of as many groups of paths");
  struct Entry {
    size_t parameter;
    int channel, unknown;
  };
  std::vector<Entry> entries;
  for (size_t j = 0; j < slopes.parameters().size(); ++j)
    for (int c = 0; c < kChannels; ++c)
      if (const int u = unknown_of(slopes.parameters()[j], c); u >= 0) entries.push_back({j, c, u});
  using Rows = Eigen::Matrix<double, kChannels, Eigen::Dynamic>;
  std::vector<Rows> without(groups);
  for (const Pixel& p : pixels) {
    Eigen::Matrix3d covariance;
    const auto& v = p.covariance;
    covariance << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
    const Eigen::LLT<Eigen::Matrix3d> root(covariance);
    Check(root.info() == Eigen::Success, "a covariance with an inverse");
    const auto whiten = [&](auto& m) { root.matrixL().solveInPlace(m); };
    Eigen::Vector3d residual(p.residual.x, p.residual.y, p.residual.z);
    Rows all = Rows::Zero(kChannels, unknowns_);
    without.assign(groups, all);
    for (const Entry& e : entries) {
      const double brightness = slopes.brightness(e.channel, p.pixel);
      all(e.channel, e.unknown) += brightness * slopes.At(e.parameter, e.channel, p.pixel);
      const std::vector<double> some = slopes.Without(e.parameter, e.channel, p.pixel);
      for (int g = 0; g < groups; ++g) without[g](e.channel, e.unknown) += brightness * some[g];
    }
    whiten(residual);
    whiten(all);
    normal_.noalias() += all.transpose() * all;
    right_.noalias() += all.transpose() * residual;
    for (int g = 0; g < groups; ++g) {
      whiten(without[g]);
      normal_without_[g].noalias() += without[g].transpose() * without[g];
      right_without_[g].noalias() += without[g].transpose() * residual;
      noise_.noalias() += (groups - 1.0) / groups * (without[g] - all).transpose() * (without[g] - all);
    }
  }
}

std::optional<WalkedStep::Solution> WalkedStep::Solve() const {
  const double groups = static_cast<double>(normal_without_.size());
  const Eigen::MatrixXd signal = normal_ - noise_;
  const Eigen::LLT<Eigen::MatrixXd> solver(signal);
  if (solver.info() != Eigen::Success) return std::nullopt;
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(unknowns_, unknowns_));
  Solution s;
  s.step = solver.solve(right_);
  Eigen::MatrixXd steps(unknowns_, static_cast<Eigen::Index>(groups));
  for (size_t g = 0; g < normal_without_.size(); ++g)
    steps.col(static_cast<Eigen::Index>(g)) =
        (normal_without_[g] - groups / (groups - 1.0) * noise_).ldlt().solve(right_without_[g]);
  const Eigen::MatrixXd off = steps.colwise() - steps.rowwise().mean();
  s.slope_covariance = (groups - 1.0) / groups * off * off.transpose();
  s.covariance = inverse * normal_ * inverse + s.slope_covariance;
  return s;
}

}  // namespace crownfit
