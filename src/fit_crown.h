#pragma once
// The main job.

#include "base/progress.h"
#include "report/crown_fit.h"

namespace crownfit {

inline constexpr int kMostCasts = 10;  ///< by shader, until what is cast again stays where it is

/// Fits the material of one capture. Never prints; how far it has come is shown by `progress`. Throws InputError.
CrownFit FitCrown(const Capture& capture, const FitOptions& options, Progress& progress,
                  const KnownBeside& beside = {});

struct ModelChoice {
  bool suffices = false;
  std::string why;
};
/// Whether a fit by shader explains the photographs: patches within their noise, and no lamp, pose or entry moved
/// further from what is known of it than by chance, where a model's errors hide. `block_chi2`: of patches' squares over
/// their noise's; `off_prior`: OffNarrowPriors.
ModelChoice WhetherShaderSuffices(double block_chi2, const std::vector<MovedCalibration>& moved, double off_prior = 0);

/// The furthest that `x` is from priors that say more than what is usual (kParameters), in their standard deviations;
/// exponents of power laws left out.
double OffNarrowPriors(const FreeParameters& free, const Eigen::VectorXd& x);

}  // namespace crownfit
