#pragma once
// How sure the fit is: from the data-only normal matrix, through its singular values, so that directions the
// photographs say nothing about get an infinite variance instead of none.

#include <optional>
#include <string>
#include <vector>

#include "fit/image_residuals.h"

namespace crownfit {

enum class Status { kFitted, kFixed, kPrior, kNotIdentified, kAtBound };
const char* Word(Status status);

/// One parameter as reported; one entry per channel, or one for all.
struct FittedParameter {
  std::string name;  ///< "dentine.absorption_per_mm"
  size_t layer;
  Quantity quantity;
  std::vector<double> value, stddev, low95, high95;  ///< stddev etc. are empty when fixed
  Status status = Status::kFixed;
};

struct Uncertainty {
  std::vector<FittedParameter> parameters;
  double reduced_chi2 = 0;  ///< of the pixels, residuals squared over degrees of freedom
  double block_chi2 = 0;    ///< of sums over patches of neighbouring pixels: larger when errors are correlated
  double inflation = 1;     ///< variances of the data were multiplied by max(1, reduced_chi2, block_chi2)
  double condition = 0;     ///< of the data-only problem in the fit's own scales
  std::vector<std::string> weak_directions;  ///< combinations that the photographs do not tell apart
};

/// `e`: evaluation with derivatives at the solution.
Uncertainty Quantify(const Capture& capture, const CastState& state, const FreeParameters& free,
                     const Eigen::VectorXd& x, const Evaluation& e, const std::vector<FitPixels>& pixels,
                     bool use_priors);

}  // namespace crownfit
