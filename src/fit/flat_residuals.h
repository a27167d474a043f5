#pragma once
// Whitened differences between instrument readings of flat samples and predictions of the `layered` model.

#include <Eigen/Core>

#include "fit/free_parameters.h"

namespace crownfit {

/// Readings of the fit (no holdouts), each over its standard deviation. The covariance includes errors that several
/// readings share: of each layer's stated thickness, and of the edge loss at an aperture, whose model has a relative
/// error. Capture and free parameters must outlive it.
class FlatResiduals {
 public:
  FlatResiduals(const Capture& capture, const FreeParameters& free, int threads);
  int count() const { return rows_; }

  struct Evaluation {
    Eigen::VectorXd residuals;  ///< predicted minus measured, whitened
    Eigen::MatrixXd jacobian;   ///< by x; filled only on request
  };
  Evaluation Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const;

 private:
  /// Measurements that share one solution of the layers, and the same with one layer a little thicker.
  struct Group {
    std::vector<FlatMeasurement> members, thicker;
    std::vector<int> first_row;                         ///< per member
    std::vector<std::pair<size_t, double>> thicker_of;  ///< index of the member, and the step in standard deviations
    std::vector<int> column_of;                         ///< per entry of `thicker`: its column among the shared errors
  };
  void Evaluate(const Group& group, const Eigen::VectorXd& x, Evaluation& e, Eigen::MatrixXd& shared) const;

  const Capture& capture_;
  const FreeParameters& free_;
  int threads_, rows_ = 0, shared_ = 1;  ///< shared errors; the edge loss is the first
  std::vector<Group> groups_;
};

}  // namespace crownfit
