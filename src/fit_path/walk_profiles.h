#pragma once
// Likelihood profiles of fits by walks.

#include <vector>

#include "fit/fit_state.h"
#include "fit/profile.h"
#include "scene/crown_input.h"

namespace crownfit {

/// How chi2 grows from where a fit by walks ended, as some entries are moved to either side and the others follow.
///
/// Nobody could see a difference of chi2 through the noise of walks. Its slope can be seen: with steps of Gauss and
/// Newton's from a place where an entry is held, d chi2 / d entry = -2 step / variance once the others have followed
/// (first order in how far they have yet to go). So every place is one comparison of the photographs with pictures
/// that are handed over to diffusion, by the same random numbers everywhere; what the slope is at the solution, which
/// that model's error and noise make, is taken off everywhere. Between places the slope is the cubic through its values
/// and curvatures (Hermite), over the variance's inflation. Chi2 is of such pictures, with their walks' noise; priors
/// included.
///
/// Of the four entries that are known least; the others are parabolas. So is a roughness: the others have far to go
/// with it; and what walks have no derivative by.
///
/// `at` and `input` are left elsewhere; what is known is not touched.
std::vector<LikelihoodProfile> ProfilesByWalks(const FitProblem& problem, CrownInput& input, FitState& at,
                                               const std::vector<int>& entries, const Uncertainty& stated,
                                               int points_a_side, Progress& progress);

}  // namespace crownfit
