#pragma once
// Whitened differences between photographs and predictions, and their derivatives. Exposures and light scales that are
// free enter linearly, so they are solved in closed form at every evaluation and projected out of the derivatives
// (variable projection, Golub and Pereyra 1973, in Kaufman's 1975 form).

#include <Eigen/Core>
#include <vector>

#include "fit/free_parameters.h"
#include "forward/predict.h"
#include "photo/photograph.h"

namespace crownfit {

/// One photograph's pixels that the fit uses. What a pixel shows is a sum over sharp ones: itself alone, or those that
/// the lens spreads into it.
struct FitPixels {
  size_t photograph;
  int exposure;             ///< index of the free exposure, -1: fixed
  std::vector<int> pixels;  ///< indices into PhotographCast::pixels
  std::vector<glm::dvec3> values, stddev;
  struct Term {
    int source;  ///< index into `sources`
    float weight;
  };
  std::vector<int> sources;     ///< the sharp pixels that are predicted: indices into PhotographCast::pixels
  std::vector<int> first_term;  ///< per pixel + 1
  std::vector<Term> terms;
  std::vector<glm::dvec3> scenery;  ///< per pixel: what scenery adds, at exposure 1; empty: nothing
};

/// Free factors of the light, solved in closed form.
struct LinearScales {
  std::vector<double> exposure;  ///< per free exposure group
  std::vector<double> light;     ///< per light of the capture (fixed ones as stated)
};

struct Evaluation {
  Eigen::VectorXd residuals;  ///< whitened; order: photograph, pixel, channel
  Eigen::VectorXd robust;     ///< sign(r) sqrt(rho(r^2)), whose squares are summed
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> jacobian;  ///< of `robust`
  LinearScales scales;
  bool finite = true;
};

struct ResidualOptions {
  double huber_width = 3.0;  ///< standard deviations from which a residual counts linearly; 0: least squares
  int threads = 0;
};

class ImageResiduals {
 public:
  ImageResiduals(const Capture& capture, const CastState& state, const FreeParameters& free,
                 const std::vector<FitPixels>& pixels, const ResidualOptions& options);
  Evaluation Evaluate(const Eigen::VectorXd& x, bool with_jacobian) const;
  int count() const { return count_; }
  double ExposureOf(const FitPixels& pixels, const LinearScales& scales) const;

 private:
  void Predict(const Material& material, const std::vector<double>& light_scale, bool with_scenery,
               Eigen::VectorXd& prediction) const;
  void PredictWithDerivatives(const Eigen::VectorXd& x, const LinearScales& scales, Evaluation& out) const;
  template <int kJetSize>
  void PredictWithDerivativesBy(const std::vector<int>& moved_slots, const Eigen::VectorXd& x,
                                const LinearScales& scales, Evaluation& out) const;
  Eigen::MatrixXd PredictPerScale(const Material& material) const;
  LinearScales SolveScales(const Eigen::MatrixXd& parts) const;

  const Capture& capture_;
  const CastState& state_;
  const FreeParameters& free_;
  const std::vector<FitPixels>& pixels_;
  ResidualOptions options_;
  std::vector<std::vector<int>> vertices_;  ///< per entry of `pixels`: around what its pixels show
  std::vector<int> free_lights_;            ///< indices of lights whose scale is free
  int free_exposures_ = 0;
  int count_ = 0;
};

}  // namespace crownfit
