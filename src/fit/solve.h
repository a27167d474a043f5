#pragma once
// Levenberg-Marquardt through Ceres. Ceres's solver is named in solve.cpp only.

#include <Eigen/Core>
#include <functional>
#include <string>

#include "fit/gaussian_information.h"
#include "fit/image_residuals.h"

namespace crownfit {

struct SolveOptions {
  int max_iterations = 100;
  bool use_priors = true;
  GaussianInformation others = {};         ///< on the free entries, in their order; empty: nothing
  double stop_when_thickness_moved = 0.2;  ///< relative to the cast value; the caller casts again
};

struct SolveResult {
  Eigen::VectorXd x;
  double cost = 0;  ///< half the robust sum of squares, priors included
  int iterations = 0;
  bool converged = false;
  bool thickness_moved = false;
  std::string message;
};

using SolveProgress = std::function<void(int iteration, double cost)>;

/// Multiplies groups of parameters (all absorptions, all scatterings, the roughness) by powers of 2 from the start.
/// Keeps the best fit, group after group, so that LM starts on the right side of the valley.
Eigen::VectorXd BracketStart(const ImageResiduals& residuals, const FreeParameters& free, const SolveOptions& options,
                             Eigen::VectorXd x);

/// Solves from `start`. If a factor on the body's depth is free, also solves from half to twice the depth found. The
/// optical depth is kept, and rounds continue as long as the cost decreases. Scattering, absorption and 1 / depth are
/// almost interchangeable, and a solver stops in that valley.
SolveResult Solve(const ImageResiduals& residuals, const FreeParameters& free, const Eigen::VectorXd& start,
                  const SolveOptions& options, const SolveProgress& progress);

}  // namespace crownfit
