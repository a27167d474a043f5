#pragma once
// A fit by model `shader`: the start of every fit of photographs, and all of it where that model suffices.

#include <string>
#include <vector>

#include "base/progress.h"
#include "fit/fit_state.h"

namespace crownfit {

inline constexpr int kMostCasts = 10;  ///< by shader, until what is cast again stays where it is

/// Casts and fits by turns, until thicknesses and calibration stay where they were cast; before walks, which need but a
/// start, a few times.
FitState FitByShader(const FitProblem& problem, CrownInput& input, Progress& progress);

struct ModelChoice {
  bool suffices = false;
  std::string why;
};
/// Whether a fit by shader explains the photographs: patches within their noise, and no lamp, pose or entry moved
/// further from what is known of it than by chance, where a model's errors hide. `block_chi2`: of patches' squares over
/// their noise's; `off_prior`: OffNarrowPriors.
ModelChoice WhetherShaderSuffices(double block_chi2, const std::vector<MovedCalibration>& moved, double off_prior = 0);

/// The furthest that `x` is from priors that say more than what is usual (kParameters), in their standard deviations;
/// exponents of power laws left out.
double OffNarrowPriors(const FreeParameters& free, const Eigen::VectorXd& x);

/// The same of where a fit by shader stands.
ModelChoice ChoiceAfter(const FitProblem& problem, const FitState& by_shader);

/// Whether a fit goes on to random walks from there: because it was asked to, or because shader does not suffice.
bool GoesOnToWalks(const FitProblem& problem, const FitState& by_shader);

}  // namespace crownfit
