#pragma once
// Options of a fit.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fit/free_parameters.h"
#include "optics/model.h"

namespace crownfit {

struct FitOptions {
  Model model = Model::kAuto;
  FitOverrides overrides;
  std::vector<std::string> leave_out;  ///< parts of the scene, as scene_parts.h names them; "unneeded"
  bool use_priors = true;
  std::filesystem::path prior;  ///< material file with priors; empty: the parameters' own
  uint64_t seed = 1;
  int threads = 0;
  size_t max_pixels_per_photograph = 6000;  ///< the fit takes every n-th pixel of larger ones; figures show them all
  size_t paths_per_photograph = 1250000;    ///< model path: walks of each of its last runs
  int collisions = 10;                      ///< model diffusion: of a walk before the switch to diffusion
  std::optional<double> target_de00, budget_s;       ///< by which model and walks are chosen (fit_plan.h)
  std::string model_choice = "chosen with --model";  ///< reason for `model`, unless it is auto
  bool twelve_taps = false;                          ///< blur by the thesis's 13 taps in place of 49
  bool advises = true;     ///< predicts which photograph would add information, where something is weak
  int profile_points = 2;  ///< per side, of likelihood profiles by fits; 0: parabolas

  /// Long runs of a path-traced fit: more pixels add information, at the same number of paths.
  size_t max_pixels_by_walks() const { return 2 * max_pixels_per_photograph; }
  bool is_planned() const { return target_de00 || budget_s; }
};

}  // namespace crownfit
