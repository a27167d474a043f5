#include "base/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>

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

Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& m) { return m.completeOrthogonalDecomposition().pseudoInverse(); }

Eigen::MatrixXd InverseRoot(const Eigen::MatrixXd& m) {
  const auto [values, vectors] = EigenOfSymmetric(m);
  return Congruent(vectors, values.cwiseSqrt().cwiseInverse().asDiagonal());
}

Eigen::MatrixXd Congruent(const Eigen::MatrixXd& a, const Eigen::MatrixXd& m) { return a * m * a.transpose(); }

Eigen::MatrixXd InUnits(const Eigen::MatrixXd& m, const Eigen::VectorXd& d) {
  return d.asDiagonal() * m * d.asDiagonal();
}

Singular SingularOf(const Eigen::MatrixXd& m) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(m);
  const Eigen::MatrixXd r = qr.matrixQR().topRows(m.cols()).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(r, Eigen::ComputeFullV);
  return {svd.singularValues(), svd.matrixV()};
}

Eigen::MatrixXd ShortestNearest(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.completeOrthogonalDecomposition().solve(b);
}

}  // namespace crownfit
