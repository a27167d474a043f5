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

/// Of any matrix, by the complete orthogonal decomposition.
Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& m);

/// m^(-1/2) of a symmetric positive matrix.
Eigen::MatrixXd InverseRoot(const Eigen::MatrixXd& m);

/// a m a^T. a: n x k; m: k x k.
Eigen::MatrixXd Congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m);

/// m_ij d_i d_j. m: n x n; d: n.
Eigen::MatrixXd InUnits(const Eigen::MatrixXd& m, const Eigen::VectorXd& d);

/// Of the decomposition m = U diag(values) V^T, without squaring m's condition number. m: n x k, n >= k; values: k,
/// descending; v: k x k.
struct Singular {
  Eigen::VectorXd values;
  Eigen::MatrixXd v;
};
Singular SingularOf(const Eigen::MatrixXd& m);

/// The shortest of those x that bring a x nearest to b; a may lack rank. a: n x k; b: n x m; x: k x m.
Eigen::MatrixXd ShortestNearest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace crownfit
