#pragma once
// One Gauss-Newton step towards photographs, with pictures and derivatives from walks: both are noisy, and known to be.
// What a fit by walks will be made of; so far studies and tests use it.

#include <Eigen/Dense>
#include <functional>
#include <optional>
#include <vector>

#include "walk/picture_slopes.h"

namespace crownfit {

/// Which unknown a slope parameter's channel moves; -1: none.
using UnknownOf = std::function<int(const SlopeParameter&, int channel)>;

class WalkedStep {
 public:
  explicit WalkedStep(int unknowns) : unknowns_(unknowns) {}

  /// A photograph's pixels: observed less predicted values, and the covariance of those differences (sensor and walks)
  /// per channel pair RR RG RB GG GB BB. The slopes must come from other walks than the prediction.
  struct Pixel {
    size_t pixel;
    glm::dvec3 residual;
    std::array<double, 6> covariance;
  };
  void Add(const PooledSlopes& slopes, const UnknownOf& unknown_of, const std::vector<Pixel>& pixels);

  struct Solution {
    Eigen::VectorXd step;
    Eigen::MatrixXd covariance;        ///< of the step: pixels, and slopes
    Eigen::MatrixXd slope_covariance;  ///< the second's share
  };
  /// The least-squares step in which the slopes' own noise, that would pull it towards zero, is taken off the normal
  /// matrix (Fuller 1987, Measurement Error Models, 2.2); the noise is found by leaving groups of paths out.
  /// Nothing when the slopes are little but noise: more paths are needed.
  std::optional<Solution> Solve() const;

 private:
  int unknowns_;
  Eigen::MatrixXd normal_, noise_;
  Eigen::VectorXd right_;
  std::vector<Eigen::MatrixXd> normal_without_;  ///< per group of paths
  std::vector<Eigen::VectorXd> right_without_;
};

}  // namespace crownfit
