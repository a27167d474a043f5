#include "base/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace crownfit {

SymmetricEigen EigenOfSymmetric(const Eigen::MatrixXd& m) {
  if (m.size() == 0) return {Eigen::VectorXd(0), Eigen::MatrixXd(0, 0)};  // Eigen would read outside of it
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(m);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

Eigen::MatrixXd SolveSymmetric(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) { return a.ldlt().solve(b); }

Eigen::MatrixXd InverseOfSymmetric(const Eigen::MatrixXd& a) {
  return SolveSymmetric(a, Eigen::MatrixXd::Identity(a.rows(), a.rows()));
}

Eigen::MatrixXd ShortestNearest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

}  // namespace crownfit
