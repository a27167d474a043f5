#pragma once
// The fit's end: Gauss-Newton steps with the path model's own pictures and derivatives.

#include "base/progress.h"
#include "fit/fit_state.h"
#include "scene/crown_input.h"

namespace crownfit {

/// Moves a fit from where another model left it to the optimum of model `path`. First a search until steps are short,
/// then runs with walks of their own until those that arrived agree within what their walks explain; the result is
/// their mean. The start is whichever of `at` and the capture's own start values explains the photographs better. With
/// `must_explain_more`, it gives up where the model that `at` comes from explains the photographs better: after the
/// search, or, where what is calibrated may move within stated errors, after it has in two runs; what was moved counts.
/// Then it is false, and `at` is as it was.
bool FitByWalks(const FitProblem& problem, CrownInput& input, FitState& at, bool must_explain_more, Progress& progress);

}  // namespace crownfit
