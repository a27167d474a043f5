#pragma once
// Whitened differences between photographs and predictions, and their derivatives, with the nuisances solved for and
// projected out. Those of the capture's measurements follow.

#include <Eigen/Core>
#include <vector>

#include "fit/flat_residuals.h"
#include "fit/free_parameters.h"
#include "fit/nuisances.h"
#include "photo/photograph.h"
#include "shader/predict.h"

namespace crownfit {

using SlotDerivativeRows = Eigen::Matrix<double, Eigen::Dynamic, kShaderSlots, Eigen::RowMajor>;

struct Evaluation {
  /// Whitened; order: photograph, pixel, channel; then stated errors of the calibration; then measurements.
  Eigen::VectorXd residuals;
  Eigen::VectorXd robust;  ///< sign(r) sqrt(rho(r^2)), whose squares are summed
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian;  ///< of `robust`
  LinearScales scales;
  bool finite = true;
};

/// A prediction of pixels (rows: photograph, pixel, channel) and its derivatives by the model's own parameters, at one
/// material.
struct LinearisedPrediction {
  Eigen::MatrixXd parts;       ///< at exposure 1: all lights of exact intensity, then one column per fitted light at 1
  Eigen::VectorXd value;       ///< at exposure 1, with all lights
  SlotDerivativeRows by_slot;  ///< of `value`, by the ShaderSlots of the row's channel
};

struct ResidualOptions {
  double huber_width = 3.0;  ///< standard deviations from which a residual counts linearly; 0: least squares
  int threads = 0;
};

class ImageResiduals {
 public:
  ImageResiduals(const Capture& capture, const CastState& state, const FreeParameters& free,
                 const std::vector<FitPixels>& pixels, const CalibrationState& calibration,
                 const ResidualOptions& options);
  /// Caches data for the next call: one thread at a time.
  Evaluation Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const;
  /// The prediction at x, with derivatives by all parameters, free or not.
  LinearisedPrediction Linearise(const Eigen::VectorXd& x) const;
  /// Evaluates with derivatives at x by a prediction that other residuals of the same pixels made near x: free entries
  /// and noise may differ. The model is not evaluated.
  Evaluation EvaluateBy(const LinearisedPrediction& there, const Eigen::VectorXd& x) const;
  int count() const { return rows_ + nuisances_.count() + flat_.count(); }

 private:
  /// `group`: of lights, as a column of PredictPerScale; the first includes the scenery's light.
  void Predict(const Material& material, const std::vector<double>& light_scale, int group,
               Eigen::Ref<Eigen::VectorXd> prediction) const;
  /// Sets value and derivatives by these slots; others are 0.
  void Linearise(const Material& material, const LinearScales& scales, const std::vector<int>& moved_slots,
                 LinearisedPrediction& out) const;
  template <int kJetSize>
  void LineariseBy(const std::vector<int>& moved_slots, const Material& material, const LinearScales& scales,
                   LinearisedPrediction& out) const;
  std::vector<int> MovedSlots() const;
  /// Residuals and derivatives of pixels.
  void Differentiate(const LinearisedPrediction& there, const Eigen::VectorXd& x, Evaluation& out) const;
  /// Adds what is not of pixels, robust weights, and the projection.
  void Complete(const Eigen::MatrixXd& parts, const Eigen::VectorXd& x, bool with_jacobian, Evaluation& out) const;
  Eigen::MatrixXd PredictPerScale(const Material& material) const;
  GatheredLight& GatheredOf(int group, size_t photograph, int channel) const {
    return gathered_[(group * pixels_.size() + photograph) * capture_.channel_names.size() + channel];
  }

  const Capture& capture_;
  const CastState& state_;
  const FreeParameters& free_;
  const std::vector<FitPixels>& pixels_;
  ResidualOptions options_;
  std::vector<std::vector<int>> vertices_;  ///< per entry of `pixels`: vertices around the points that its pixels show
  Nuisances nuisances_;
  FlatResiduals flat_;
  std::vector<int> first_row_;  ///< per entry of `pixels`
  int rows_ = 0;                ///< of pixels
  mutable std::vector<GatheredLight> gathered_;
  struct Parts {
    Eigen::VectorXd x;
    Eigen::MatrixXd parts;
  };
  mutable Parts last_;  ///< a step is evaluated without derivatives first, and with them once accepted
};

}  // namespace crownfit
