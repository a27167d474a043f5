#pragma once
// The fit's end: Gauss-Newton steps with the path model's own pictures and derivatives.

#include <algorithm>

#include "fit/walked_step.h"
#include "fit_state.h"

namespace crownfit {

inline constexpr uint64_t kFitStream = 0x6669747365656bull;  ///< no photograph's synthesis is keyed by it
// Of the paths that are asked for: what walks of model diffusion tell as much by, what a search walks handed over, and
// what to their end.
inline constexpr double kOfHandedOver = 0.2, kSearchShare = 0.1, kMiddleShare = 0.4;
/// Of a photograph, for a search: every pixel takes its walks (FewestPaths), and derivatives three times as many.
inline constexpr size_t kPixelsOfSearch = 2500;

/// Beside so many paths for values in a long run, for derivatives, of which those of several runs are averaged. By a
/// fifth of the fewest, a small tooth's tell a third as much.
inline double SlopePaths(double paths) {
  constexpr double kShare = 0.3, kMostShare = 1.5, kFewest = 300000.0;
  return std::max(kShare * paths, std::min(kFewest, kMostShare * paths));
}

/// Moves a fit from where another model left it to the optimum of model `path`. First short runs until steps are no
/// larger than their noise, then long ones with walks of their own until those that arrived agree within what their
/// walks explain; the result is their mean. The start is whichever of `at` and the capture's own
/// start values explains the photographs better. With `must_explain_more`, it gives up where the model that `at` comes
/// from explains the photographs better: after the search, or, where what is calibrated may move within stated errors,
/// after it has in long runs; what was moved counts. Then it is false, and `at` is as it was.
bool FitByWalks(const FitProblem& problem, CrownInput& input, FitState& at, bool must_explain_more, Progress& progress);

/// Where the photographs alone would have the unknowns go from where a fit stands, by one run of few walks.
WalkedStep::Solution StepByWalks(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress);

/// Pictures of every photograph, held-out ones included, to look at: walks at the solution; where they are noisier than
/// shader's picture is wrong, shader's detail times the ratio of both over a few pixels.
Predictor PredictorByWalks(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress);

}  // namespace crownfit
