#pragma once
// Nuisance parameters: what enters the photographs linearly besides the material. They are exposures and light
// intensities that are free or known within an error, and stated errors of the calibration, as far as they are small.
// They are solved for in closed form at every evaluation and projected out of the derivatives (variable projection,
// Golub and Pereyra 1973, in Kaufman's 1975 form). So every interval includes their uncertainty. Stated errors are
// measurements: they add rows of residuals.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "photo/spectrum.h"

namespace crownfit {

struct Capture;

/// One photograph's pixels that the fit uses. A pixel's value is a sum over sharp pixels: itself alone, or those that
/// the lens spreads into it.
struct FitPixels {
  size_t photograph;
  int exposure;             ///< index of the fitted exposure, -1: exact
  std::vector<int> pixels;  ///< indices into PhotographCast::pixels
  std::vector<Spectrum> values, stddev;
  struct Term {
    int source;  ///< index into `sources`
    float weight;
  };
  std::vector<int> sources;     ///< the sharp pixels that are predicted: indices into PhotographCast::pixels
  std::vector<int> first_term;  ///< per pixel + 1
  std::vector<Term> terms;
  std::vector<Spectrum> scenery;  ///< per pixel: the scenery's contribution, at exposure 1; empty: none

  /// The terms of a pixel's sum, without its scenery.
  std::span<const Term> TermsOf(size_t pixel) const {
    return {terms.data() + first_term[pixel], terms.data() + first_term[pixel + 1]};
  }
  int channels() const { return values.empty() ? 0 : values[0].size(); }
  Spectrum SceneryAt(size_t pixel) const { return scenery.empty() ? Spectrum(0.0) : scenery[pixel]; }
};

/// Derivatives of one photograph's pixels by stated errors, at exposure 1.
struct CalibrationDerivatives {
  std::vector<int> errors;             ///< their indices
  Eigen::MatrixXd by_error;            ///< (pixel, channel) x errors, per standard deviation
  Eigen::MatrixXd of_photograph = {};  ///< at the photograph's exposure; replaces ...
  Eigen::MatrixXd of_shader = {};      ///< ... this part of by_error; both empty: none
};

/// The calibration of the cast, and derivatives by moving it.
struct CalibrationState {
  std::vector<double> amounts;                      ///< per stated error, in its standard deviations
  std::vector<CalibrationDerivatives> derivatives;  ///< per FitPixels; empty: the calibration is not moved
};

/// Nuisances, solved for in closed form.
struct LinearScales {
  std::vector<double> exposure;     ///< per fitted exposure
  std::vector<double> light;        ///< per light of the capture (exact ones as stated)
  std::vector<double> calibration;  ///< per stated error: change since the cast, in its standard deviations
  bool settled = true;              ///< whether the steps to them converged
};

class Nuisances {
 public:
  Nuisances(const Capture& capture, const std::vector<FitPixels>& pixels, const CalibrationState& calibration);

  int count() const { return exposures_ + static_cast<int>(lights_.size()) + errors_; }
  const std::vector<int>& lights() const { return lights_; }  ///< indices of the capture's lights with fitted intensity

  LinearScales Stated() const;
  double ExposureOf(const FitPixels& pixels, const LinearScales& scales) const;

  /// Prediction at exposure 1. `parts`: column 0 all lights of exact intensity, then one per fitted light at 1.
  Eigen::VectorXd Prediction(const Eigen::MatrixXd& parts, const LinearScales& scales) const;
  /// The change of that prediction by the moved calibration.
  Eigen::VectorXd Addition(const LinearScales& scales) const;

  /// (exposure x prediction - value) / stddev.
  Eigen::VectorXd Residuals(const Eigen::VectorXd& prediction, const LinearScales& scales) const;
  /// (nuisance - stated) / stddev, 0 for free ones.
  Eigen::VectorXd PriorResiduals(const LinearScales& scales) const;

  /// The best-fitting nuisances, by Gauss-Newton with Huber's weights (`huber_width` 0: least squares).
  LinearScales Solve(const Eigen::MatrixXd& parts, double huber_width) const;

  /// Projects the nuisances out of `jacobian` (rows: pixels, then priors). `slope`: derivative of the robust residuals
  /// by the plain ones.
  void Project(const Eigen::MatrixXd& parts, const LinearScales& scales, const Eigen::VectorXd& slope,
               Eigen::Ref<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian) const;

 private:
  /// Derivatives of one photograph's residuals by the nuisances that it depends on.
  struct Block {
    int first_row;
    std::vector<int> columns;
    Eigen::MatrixXd by_column;
  };
  std::vector<Block> Blocks(const Eigen::MatrixXd& parts, const LinearScales& scales) const;
  void SetExposuresAlone(const Eigen::MatrixXd& parts, LinearScales& scales) const;

  const Capture& capture_;
  const std::vector<FitPixels>& pixels_;
  const CalibrationState& calibration_;
  int rows_ = 0, exposures_ = 0, errors_ = 0;
  std::vector<int> lights_;
  std::vector<size_t> first_photograph_;  ///< per exposure: the one whose stated value is its start
  Eigen::VectorXd sharpness_;             ///< 1 / stated stddev per nuisance, 0 for free ones
};

}  // namespace crownfit
