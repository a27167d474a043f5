#pragma once
// A fit's state at the start values, from which everything is foreseen.

#include "base/progress.h"
#include "fit/fit_state.h"
#include "fit/image_residuals.h"

namespace crownfit {

/// The start values as if a fit had ended there and the photographs agreed; `e`: with derivatives. Throws InputError
/// where the prediction is not finite.
FitState StateAtStart(const FitProblem& problem, const CrownInput& input, Evaluation& e, Progress& progress);

}  // namespace crownfit
