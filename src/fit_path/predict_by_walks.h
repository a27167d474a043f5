#pragma once
// Pictures by random walks of where a fit stands.

#include "fit/compare_photographs.h"
#include "fit/fit_state.h"

namespace crownfit {

/// Pictures of every photograph, held-out ones included, to look at: walks at the solution; where they are noisier than
/// shader's picture is wrong, shader's detail times the ratio of both over a few pixels.
Predictor PredictorByWalks(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress);

}  // namespace crownfit
