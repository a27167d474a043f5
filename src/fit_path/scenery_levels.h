#pragma once
// What photographs show beside the object of its tile and of scenery, whose reflectances are stated: a witness of
// exposures, lamps and reflectances that no material can make up for.

#include <vector>

#include "fit/fit_state.h"

namespace crownfit {

/// Per photograph: how much brighter what lies beside the object is than the capture states it (where exposures and
/// lamps are free: than they were found), by walks in some hundred pixels; the fitted material adds its reflections.
/// Photographs whose mask leaves nothing there, or that state neither tile nor scenery, are left out. `input` is left
/// as it was.
std::vector<SceneryLevel> SceneryLevelsOf(const FitProblem& problem, CrownInput& input, const FitState& at,
                                          const std::vector<PhotographResult>& results, Progress& progress);

}  // namespace crownfit
