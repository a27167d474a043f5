#pragma once
// What is known of free entries beside the photographs at hand: from other captures of the same material.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/free_parameters.h"

namespace crownfit {

/// The directions that a precision (symmetric, no negative eigenvalue but by rounding) knows something of, and others.
struct SeenDirections {
  explicit SeenDirections(const Eigen::MatrixXd& precision);
  /// 0 along unseen directions.
  Eigen::MatrixXd Inverse() const { return seen * precision.cwiseInverse().asDiagonal() * seen.transpose(); }
  Eigen::MatrixXd seen, unseen;  ///< columns of length 1
  Eigen::VectorXd precision;     ///< of the seen ones
  double condition = 0;          ///< largest over smallest standard deviation of the seen ones
};

/// A Gaussian over entries in their own scales, in its information form, so that knowledge from independent sources
/// adds up, and directions of which nothing is known have precision 0.
struct GaussianInformation {
  std::vector<std::string> names;  ///< as FreeEntry::name
  Eigen::MatrixXd precision;
  Eigen::VectorXd weighted_mean;  ///< precision times mean
};

std::vector<std::string> NamesOf(const std::vector<FreeEntry>& entries);

/// Nothing known of these.
GaussianInformation NothingOf(const std::vector<std::string>& names);

/// The same about `names` alone, of those it knows: the others are integrated out.
GaussianInformation Marginal(const GaussianInformation& knowledge, const std::vector<std::string>& names);

/// Adds what `more` knows of `knowledge`'s names, and nothing of others.
void Add(GaussianInformation& knowledge, const GaussianInformation& more);

/// Where the knowledge stands; along directions that nothing is known of, as near to `otherwise` as possible.
Eigen::VectorXd MeanOf(const GaussianInformation& knowledge, const Eigen::VectorXd& otherwise);

/// What fits of other captures of the same material know, and where to start from: both in the order of the free
/// entries, or empty.
struct KnownBeside {
  GaussianInformation others;
  Eigen::VectorXd start;
};

/// How far two independent sources are apart in what both know something of.
struct Disagreement {
  double chi2 = 0;
  int freedom = 0;
  std::string name;            ///< the entry that most of it is about
  double here = 0, there = 0;  ///< where they put that entry
};
/// `a` and `b` know of the same entries.
Disagreement Compared(const GaussianInformation& a, const GaussianInformation& b);

/// What chi2 exceeds by chance in this share of all cases.
double UnlikelyChi2(int freedom, double by_chance = 1e-4);

}  // namespace crownfit
