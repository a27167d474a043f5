#pragma once
// The input of a fit, and its current state.

#include "capture/calibration_error.h"
#include "fit/compare_photographs.h"
#include "fit/free_parameters.h"
#include "fit/nuisances.h"
#include "fit/scattering_laws.h"
#include "fit/uncertainty.h"
#include "fit/walk_comparison.h"

namespace crownfit {

struct FitProblem {
  const Capture& capture;  ///< as stated, with the overrides applied
  const FreeParameters& free;
  const std::vector<CalibrationError>& errors;
  const FitOptions& options;
  GaussianInformation others = {};  ///< on the free entries, in their order; empty: nothing
};

struct FitState {
  Eigen::VectorXd x;
  LinearScales scales;           ///< its `calibration`: change since `calibration` below
  CalibrationState calibration;  ///< how far the calibration is from the stated one
  CastState cast;
  std::vector<FitPixels> pixels;
  DataEstimate knowledge;
  std::vector<ShaderIteration> iterations_by_shader;
  std::vector<WalkedFitStep> steps;
  std::vector<std::vector<Spectrum>> walked;   ///< path-traced values of `pixels`' sharp pixels, at the solution
  ResidualChi2 residual_chi2;                  ///< path-traced, at the solution
  std::vector<ResidualChi2> residual_chi2_of;  ///< of `pixels`' photographs
  int iterations = 0, casts = 0;
  double walked_paths = 0;
  InflatedErrors inflation{1, 1, 1, 1};  ///< factors on stated errors in path-traced steps
  std::vector<double> rival_roughness;   ///< of other optima as good as the current state
  std::vector<LawDeparture> departures;  ///< by walks: from the laws that scattering keeps
  bool converged = false;
};

}  // namespace crownfit
