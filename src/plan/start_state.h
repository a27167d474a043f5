#pragma once
// A fit's state at the start values, from which everything is foreseen.

#include "base/progress.h"
#include "fit/fit_state.h"
#include "fit/image_residuals.h"
#include "plan/coarseness.h"

namespace crownfit {

/// The start values as if a fit had ended there, and the prediction of its pixels. `coarse`: how much coarser `input`
/// is than what a fit would take; pixels then have as little noise as the fit's have together. Throws InputError where
/// the prediction is not finite.
FitState StateAtStart(const FitProblem& problem, const CrownInput& input, LinearisedPrediction& prediction,
                      Progress& progress, const Coarseness& coarse = {});

/// What model `shader` would evaluate at x if the photographs agreed with its prediction there. `capture` may free
/// other entries than the problem that `at` belongs to, and `pixels` have other noise than its own.
Evaluation AgreeingEvaluation(const FitProblem& problem, const FitState& at, const std::vector<FitPixels>& pixels,
                              const LinearisedPrediction& prediction, const Eigen::VectorXd& x);

}  // namespace crownfit
