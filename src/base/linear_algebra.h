// Eigen's dense decompositions as functions, compiled once: each takes some ten seconds to compile wherever it is
// instantiated.
#pragma once

#include <Eigen/Core>

namespace crownfit {

/// Eigenvalues ascending; unit eigenvectors as columns, in the same order.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

/// Eigendecomposition of a symmetric matrix; only its lower half is read.
SymmetricEigen EigenOfSymmetric(const Eigen::MatrixXd& m);

/// Solves a x = b by LDLT, for a symmetric positive semidefinite a. a: n x n; b and x: n x m.
Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

Eigen::MatrixXd InverseOfSymmetric(const Eigen::MatrixXd& a);

/// Pseudo-inverse of any matrix, by the complete orthogonal decomposition.
Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& m);

/// m^(-1/2) of a symmetric positive definite matrix.
Eigen::MatrixXd InverseRoot(const Eigen::MatrixXd& m);

/// a m a^T. a: n x k; m: k x k.
Eigen::MatrixXd Congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m);

/// m_ij d_i d_j. m: n x n; d: n.
Eigen::MatrixXd InUnits(const Eigen::MatrixXd& m, const Eigen::VectorXd& d);

/// Singular values and right singular vectors of m = U diag(values) V^T, without squaring m's condition number. m:
/// n x k, n >= k; values: k, descending; v: k x k.
struct Singular {
  Eigen::VectorXd values;
  Eigen::MatrixXd v;
};
Singular SingularOf(const Eigen::MatrixXd& m);

/// Minimum-norm least-squares solution of a x = b; a may be rank deficient. a: n x k; b: n x m; x: k x m.
Eigen::MatrixXd ShortestNearest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace crownfit
