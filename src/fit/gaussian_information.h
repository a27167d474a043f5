#pragma once
// Information on free entries from elsewhere than the photographs at hand: from other captures of the same material.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/free_parameters.h"

namespace crownfit {

/// The directions that a precision matrix constrains, and the others. It is symmetric, without negative eigenvalues
/// except by rounding.
struct SeenDirections {
  explicit SeenDirections(const Eigen::MatrixXd& precision);
  /// 0 along unseen directions.
  Eigen::MatrixXd Inverse() const { return seen * precision.cwiseInverse().asDiagonal() * seen.transpose(); }
  Eigen::MatrixXd seen, unseen;  ///< columns of length 1
  Eigen::VectorXd precision;     ///< of the seen ones
  double condition = 0;          ///< largest over smallest standard deviation of the seen ones
};

/// A Gaussian over entries in their own scales, in information form: independent sources add up, and unconstrained
/// directions have precision 0.
struct GaussianInformation {
  std::vector<std::string> names;  ///< as FreeEntry::name
  Eigen::MatrixXd precision;
  Eigen::VectorXd weighted_mean;  ///< precision times mean
};

std::vector<std::string> NamesOf(const std::vector<FreeEntry>& entries);

/// No information on these.
GaussianInformation NothingOf(const std::vector<std::string>& names);

/// The marginal over those of `names` that it holds: the others are integrated out.
GaussianInformation Marginal(const GaussianInformation& knowledge, const std::vector<std::string>& names);

/// Adds the information of `more` on `knowledge`'s names; its other names are integrated out.
void Add(GaussianInformation& knowledge, const GaussianInformation& more);

/// The mean; along unconstrained directions as close to `otherwise` as possible.
Eigen::VectorXd MeanOf(const GaussianInformation& knowledge, const Eigen::VectorXd& otherwise);

/// Information from fits of other captures of the same material, and the start: both in the order of the free entries,
/// or empty.
struct KnownBeside {
  GaussianInformation others;
  Eigen::VectorXd start;
};

/// How far two independent sources are apart, along directions that both constrain.
struct Disagreement {
  double chi2 = 0;
  int freedom = 0;
  std::string name;            ///< the entry that contributes most
  double here = 0, there = 0;  ///< the two values of that entry
};
/// `a` and `b` must have the same entries.
Disagreement Compared(const GaussianInformation& a, const GaussianInformation& b);

/// The chi2 that is exceeded by chance with this probability.
double UnlikelyChi2(int freedom, double by_chance = 1e-4);

}  // namespace crownfit
