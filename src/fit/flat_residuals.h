#pragma once
// Whitened differences between what instruments have read of flat samples and what the `layered` model predicts.

#include <Eigen/Core>

#include "fit/free_parameters.h"

namespace crownfit {

/// Readings that are fitted (holdouts are not), each over its standard deviation. Errors that several readings share
/// are in their covariance: of each layer's stated thickness, and of the edge loss at an aperture, which is modelled to
/// within a share. Capture and free parameters must outlive it.
class FlatResiduals {
 public:
  FlatResiduals(const Capture& capture, const FreeParameters& free, int threads);
  int count() const { return rows_; }

  struct Evaluation {
    Eigen::VectorXd residuals;  ///< predicted less read, whitened
    Eigen::MatrixXd jacobian;   ///< by x; not filled unless asked for
  };
  Evaluation Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const;

 private:
  /// Measurements that one solution of the layers serves, then the same with one layer a little thicker.
  struct Group {
    std::vector<FlatMeasurement> members, thicker;
    std::vector<int> first_row;                         ///< per member
    std::vector<std::pair<size_t, double>> thicker_of;  ///< which member, by how many standard deviations
    std::vector<int> column_of;                         ///< of each of `thicker`, among the shared errors
  };
  void Evaluate(const Group& group, const Eigen::VectorXd& x, Evaluation& e, Eigen::MatrixXd& shared) const;

  const Capture& capture_;
  const FreeParameters& free_;
  int threads_, rows_ = 0, shared_ = 1;  ///< shared errors: the edge loss's first
  std::vector<Group> groups_;
};

}  // namespace crownfit
