#pragma once
// What a scene requires: what leaving out each part of it would change, in the picture and in the parameters.

#include <string>
#include <vector>

#include "fit/finding.h"
#include "fit/fit_state.h"
#include "fit/image_residuals.h"
#include "plan/coarseness.h"
#include "plan/fit_seconds.h"

namespace crownfit {

struct SceneRequirement {
  std::string what;                 ///< "light 'left'", "tile 'white'", "the surface's reflection"
  std::string photograph;           ///< in which it changes most
  double de00 = 0;                  ///< CIEDE2000 there, mean over blocks
  std::string parameter;            ///< of the free entries: which moves most
  double shift = 0;                 ///< by how many standard deviations of what the photographs tell by themselves
  double shader_s = 0, path_s = 0;  ///< which a fit without it would save, on two cores
  std::string hides;                ///< the photograph in which it hides part of the object; empty: in none
  bool is_needed = false;           ///< more than kSeenDe00 or kToldShift
};

/// More than this is seen, or tells of the material.
inline constexpr double kSeenDe00 = 0.1, kToldShift = 0.25;

/// Lights beside others, tiles, scenery, the surface's reflection, its film of water and the step between the layers,
/// each left out in turn, by model `shader` where the fit stands. Shifts are to first order: the step by which a fit
/// without it would miss.
/// `prediction`: of `at`, cast with `coarse.cast`.
std::vector<SceneRequirement> SceneRequirements(const FitProblem& problem, const CrownInput& input, const FitState& at,
                                                const LinearisedPrediction& prediction, const FitSeconds& seconds,
                                                const Coarseness& coarse, Progress& progress);

struct LeftOutPart {
  std::string name;
  Finding finding;
};

/// Leaves out of the photographs that are fitted what the options name; "unneeded" names what, at the start values, is
/// not needed even together. Nothing that hides the object is left out, and of what is unneeded no tile or scenery
/// beside walks, which judge the light by them. Throws InputError.
std::vector<LeftOutPart> LeaveOut(const FitOptions& options, CrownInput& input, Progress& progress);

}  // namespace crownfit
