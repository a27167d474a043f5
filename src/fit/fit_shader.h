#pragma once
// A fit with model `shader`: the start of every fit to photographs, and the whole fit where that model suffices.

#include <string>
#include <vector>

#include "base/progress.h"
#include "fit/fit_state.h"

namespace crownfit {

inline constexpr int kMostCasts = 10;  ///< upper limit, by shader

/// Alternates casts and fits until thicknesses and calibration agree with the cast. Before random walks, which need
/// only a start, it stops after a few rounds.
FitState FitByShader(const FitProblem& problem, CrownInput& input, Progress& progress);

struct ModelChoice {
  bool suffices = false;
  std::string why;
};
/// Whether a shader fit explains the photographs: patches agree within their noise, and no lamp, pose or entry moved
/// further than chance allows, where a model's errors would hide. `block_chi2`: squares of patches over those of their
/// noise; `off_prior`: OffNarrowPriors.
ModelChoice WhetherShaderSuffices(double block_chi2, const std::vector<MovedCalibration>& moved, double off_prior = 0);

/// The largest distance of `x` from priors that are narrower than the usual ones (kParameters), in their standard
/// deviations; exponents of power laws left out.
double OffNarrowPriors(const FreeParameters& free, const Eigen::VectorXd& x);

/// The same for the current state of a shader fit.
ModelChoice ChoiceAfter(const FitProblem& problem, const FitState& by_shader);

/// Whether a fit goes on to random walks: because it was requested, or because shader does not suffice.
bool GoesOnToWalks(const FitProblem& problem, const FitState& by_shader);

}  // namespace crownfit
