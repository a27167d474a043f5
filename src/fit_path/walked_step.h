#pragma once
// One Gauss-Newton step towards photographs, with pictures and derivatives from walks: both are noisy, and known to be.

#include <Eigen/Cholesky>
#include <array>
#include <functional>
#include <vector>

#include "path/pooled_derivatives.h"

namespace crownfit {

/// From the six numbers that a PixelEstimate holds: RR RG RB GG GB BB.
Eigen::MatrixXd CovarianceOf(const PixelEstimate& pixel);

/// Derivatives of one pixel's channels by the unknowns.
struct WalkedRows {
  using Rows = Eigen::MatrixXd;  ///< one row per channel
  Rows all;                      ///< by the first unknowns, from all paths ...
  std::vector<Rows> without;     ///< ... and from all but each group's
  Rows exact;                    ///< by the other unknowns
};

/// How unknowns move what derivatives are by: d(parameter) / d(unknowns) of one channel, with the parameter as
/// DerivativeParameter differentiates by it. Empty: not at all.
using SlopeChain = std::function<Eigen::RowVectorXd(const DerivativeParameter&, int channel)>;

/// Turns a photograph's derivatives into rows: for every parameter the mean of the runs that tell it, which may stand
/// at somewhat different places.
class RowsOfSlopes {
 public:
  struct Run {
    const PooledDerivatives* derivatives;
    double weight;
    std::function<bool(const DerivativeParameter&)> tells = [](const DerivativeParameter&) { return true; };
  };
  /// Runs of as many groups; they must outlive it.
  RowsOfSlopes(const std::vector<Run>& runs, const SlopeChain& chain, int unknowns);
  /// Adds `weight` times the derivatives of a pixel.
  void AddTo(WalkedRows& rows, size_t pixel, double weight) const;
  WalkedRows Zero(int exact = 0) const;

 private:
  struct Entry {
    const PooledDerivatives* derivatives;
    size_t parameter;
    int channel;
    Eigen::RowVectorXd chain;  ///< times the run's share
  };
  std::vector<Entry> entries_;
  int unknowns_, groups_, channels_ = 0;
};

class WalkedStep {
 public:
  /// The first `of_slopes` unknowns have derivatives from groups of paths, `exact` others have none of their noise.
  WalkedStep(int of_slopes, int groups, int exact = 0);

  /// Observed less predicted values, the covariance of that difference, and the share of it that the prediction's own
  /// walks make. The derivatives must come from other walks than the prediction.
  struct Pixel {
    Eigen::VectorXd residual;
    Eigen::MatrixXd covariance, of_walks = {};  ///< of_walks empty: none
    /// How far the means of groups of the prediction's paths are off the mean of all, where pixels share walks: group
    /// g of every pixel with these. Empty: no other pixel has walks in common with this one.
    Eigen::MatrixXd off_by_group = {};
  };
  void Add(const Pixel& pixel, WalkedRows rows);
  void Add(const WalkedStep& other);
  /// What no walk says: whitened differences, observed less predicted, and the prediction's derivatives by the first
  /// unknowns.
  void AddExact(const Eigen::VectorXd& residual, const Eigen::MatrixXd& derivatives);

  /// What is known of the unknowns beside the photographs, or holds them near where they are: the inverse of a
  /// covariance, and that times (where it wants them - where they are).
  struct Prior {
    Eigen::MatrixXd precision;
    Eigen::VectorXd pull;
  };
  struct Solution {
    Eigen::VectorXd step;
    Eigen::MatrixXd covariance;        ///< of the step: pixels, and derivatives
    Eigen::MatrixXd walk_covariance;   ///< the prediction's walks' and the derivatives' share
    Eigen::MatrixXd slope_covariance;  ///< the derivatives' share
    double gain = 0, noise_gain = 0;   ///< what the step takes off the photographs' chi2; what its noise alone would
    bool seen = true;  ///< false: derivatives tell some unknowns no better than noise would; those get the prior alone
  };
  enum class Noise { kTakenOff, kLeft };
  /// The least-squares step in which the derivatives' own noise, that would pull it towards zero, is taken off the
  /// normal matrix (Fuller 1987, Measurement Error Models, 2.2); the noise is found by leaving groups of paths out, to
  /// first order. `held`: unknowns that stay where they are. With the noise left in, steps are too short, and the safer
  /// the noisier.
  Solution Solve(const Prior& prior, const std::vector<int>& held = {}, Noise noise = Noise::kTakenOff) const;

 private:
  Eigen::MatrixXd NormalWithout(size_t group) const;

  int unknowns_, of_slopes_;
  Eigen::MatrixXd normal_, noise_;
  Eigen::MatrixXd of_walks_, of_own_walks_;  ///< of all pixels; of those that share none
  Eigen::VectorXd right_;
  Eigen::MatrixXd right_off_;                    ///< a column per group of the prediction's paths
  std::vector<Eigen::MatrixXd> normal_without_;  ///< per group of the derivatives' paths: the rows of_slopes
  std::vector<Eigen::VectorXd> right_without_;
};

}  // namespace crownfit
