#pragma once
// What can be said of a capture before it is fitted.

#include <string>
#include <vector>

#include "fit/image_residuals.h"
#include "fit/scattering_laws.h"
#include "plan/exact_statements.h"
#include "plan/foresee_photographs.h"
#include "plan/scene_requirements.h"

namespace crownfit {

/// What the photographs would tell of one free entry, in the words of its 95 % interval.
struct ForeseenEntry {
  std::string name, by_shader, by_path;  ///< of measurements alone: in `by_path`, by model `layered`
};

struct CaptureCheck {
  CrownInput input;
  std::shared_ptr<const Crown> crown;  ///< nothing where measurements alone are given
  std::vector<Finding> caveats;
  std::vector<ForeseenEntry> foreseen;
  std::vector<WeakDirection> weak_directions;  ///< in a fit by model path
  std::vector<SceneRequirement> requirements;
  std::vector<ExactStatement> exact;
  std::vector<SharedScattering> shared;
  std::string advice;  ///< which photograph would tell a fit by walks more; empty: nothing is weak, or none
  double shader_s = 0, path_s = 0;  ///< of two cores, that nine of ten fits take at most (FitSeconds)
};

/// Reads and builds everything, and foresees at the start values, by the derivatives of model `shader` and the
/// photographs' own noise, what a fit would know. Throws InputError.
CaptureCheck CheckCapture(const Capture& capture, const FitOptions& options, Progress& progress);

}  // namespace crownfit
