#pragma once
// What a fit takes for exact, and what would come of it were it not.

#include <string>
#include <vector>

#include "fit/fit_state.h"

namespace crownfit {

/// A parameter that the capture fixes.
struct ExactStatement {
  std::string name;   ///< "enamel.ior"
  double value = 0;   ///< as stated
  std::string error;  ///< by which it is taken to be off, such as "0.05" or "10 %"
  struct Shift {
    std::string parameter;  ///< "enamel.reduced_scattering_per_mm"
    double share = 0;       ///< of the value, largest over the channels
  };
  std::vector<Shift> shifts;  ///< largest first; below 1 % left out
};

/// What errors of index and thickness would do to what is fitted, where the capture fixes them: to first order, by
/// derivatives of model `shader` where the fit stands. Those that would do nothing are left out.
std::vector<ExactStatement> ExactStatements(const FitProblem& problem, const FitState& at,
                                            const LinearisedPrediction& prediction);

}  // namespace crownfit
