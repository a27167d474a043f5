#pragma once
// What to photograph next: what each of the photographs that could be taken would tell of the weakest parameter.

#include <optional>
#include <string>
#include <vector>

#include "fit/fit_state.h"
#include "plan/photograph_ideas.h"

namespace crownfit {

struct ForeseenPhotograph {
  PhotographIdea idea;
  double stddev;  ///< of the weakest entry, with it
};

struct Foresight {
  int weakest = -1;   ///< of the free entries: the one known least, measured by its prior's width
  double stddev = 0;  ///< of it now, in its own scale
  /// What narrows it most, first; at most three. Empty when it is known within a factor 1.5 (IsWeak).
  std::vector<ForeseenPhotograph> best;

  /// Whether the first narrows it by a fifth at least, and to what tells something.
  bool IsWorthTaking() const;
};

/// By derivatives of model `shader` at the fit's solution and a noise as that of the photograph that an idea varies
/// (its median relative to the signal, and its floor). A fit by walks keeps what it knows, and the idea's own
/// derivatives add to it; one by `shader` carries its model's errors in what it adds as well. Lamps are as bright as
/// the fit found them, an exposure that the base leaves open is one of its own; errors of poses are not foreseen.
Foresight ForeseePhotographs(const FitProblem& problem, const CrownInput& input, const FitState& at,
                             Progress& progress);

/// The photograph's pixels with the noise that a fit by so many walks of it adds.
FitPixels WithNoiseOfWalks(FitPixels pixels, double paths);

/// An entry's 95 % interval in words: "a factor 1.3" between its ends, or "+-0.1".
std::string IntervalInWords(const FreeEntry& entry, double stddev);

/// "Most would be learned of 'dentine.absorption_per_mm[B]' (95 % interval: a factor 3.1) by a photograph as ...".
std::string AdviceIn(const FreeParameters& free, const Foresight& foresight);

}  // namespace crownfit
