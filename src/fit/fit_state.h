#pragma once
// What a fit is given, and where it stands.

#include "capture/calibration_error.h"
#include "fit/compare_photographs.h"
#include "fit/free_parameters.h"
#include "fit/nuisances.h"
#include "fit/uncertainty.h"
#include "fit/walk_comparison.h"

namespace crownfit {

struct FitProblem {
  const Capture& capture;  ///< as stated, with the overrides applied
  const FreeParameters& free;
  const std::vector<CalibrationError>& errors;
  const FitOptions& options;
  GaussianInformation others = {};  ///< of the free entries, in their order; empty: nothing
};

struct FitState {
  Eigen::VectorXd x;
  LinearScales scales;           ///< `calibration` in it: further than `calibration` below
  CalibrationState calibration;  ///< how far the stated calibration is moved
  CastState cast;
  std::vector<FitPixels> pixels;
  DataEstimate knowledge;
  std::vector<ShaderIteration> iterations_by_shader;
  std::vector<WalkedFitStep> steps;
  std::vector<std::vector<glm::dvec3>> walked;  ///< values of `pixels`' sharp pixels by walks, at the solution
  ResidualChi2 residual_chi2;                   ///< by walks, at the solution
  std::vector<ResidualChi2> residual_chi2_of;   ///< of `pixels`' photographs
  int iterations = 0, casts = 0;
  double walked_paths = 0;
  InflatedErrors inflation{1, 1, 1, 1};  ///< what steps by walks take stated errors for
  std::vector<double> rival_roughness;   ///< of other optima, as good as where the fit stands
  bool converged = false;
};

}  // namespace crownfit
