// Eigen's dense decompositions as functions, compiled once: each costs a compiler some ten seconds wherever it is
// written.
#pragma once

#include <Eigen/Core>

namespace crownfit {

/// Values ascending; vectors of length 1, one a column, in the values' order.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// Of a symmetric matrix, whose lower half is read.
SymmetricEigen EigenOfSymmetric(const Eigen::MatrixXd& m);

/// x of a x = b, where a is symmetric and not negative, by LDLT. a: n x n; b and x: n x m.
Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

Eigen::MatrixXd InverseOfSymmetric(const Eigen::MatrixXd& a);

/// The shortest of those x that bring a x nearest to b; a may lack rank. a: n x k; b: n x m; x: k x m.
Eigen::MatrixXd ShortestNearest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace crownfit
