#pragma once
// Which model a fit begins with, and with how many walks, where a user states what the fit is for: by how far models
// are off on this scene, and by stored costs.

#include <string>
#include <vector>

#include "base/progress.h"
#include "capture/capture.h"
#include "fit/fit_options.h"

namespace crownfit {

/// A way to fit. Seconds are those of the two cores of docs/validation.md, whatever machine it runs on: the choice must
/// not depend on it.
struct FitPlan {
  Model model = Model::kShader;     ///< or path
  size_t paths_per_photograph = 0;  ///< model path
  double de00 = 0;     ///< by which pictures of its material will be off, about: CIEDE2000, median over blocks
  double seconds = 0;  ///< at most, in nine of ten cases
  std::string why;     ///< one line
};

/// The cheapest way that is accurate to `target_de00`, or the most accurate within `budget_s`, as the options ask; with
/// both, the cheapest that keeps both. Walks the photographs at the start values to see how far `shader` is off and how
/// noisy walks are. Throws InputError when no model can, and for more than one capture.
FitPlan PlanFit(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress);

FitOptions WithPlan(FitOptions options, const FitPlan& plan);

}  // namespace crownfit
