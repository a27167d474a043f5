#pragma once
// The main job.

#include "base/progress.h"
#include "fit/fit_result.h"

namespace crownfit {

/// Fits the material of one capture. Never prints; shows its progress in `progress`. Throws InputError.
CrownFit FitCrown(const Capture& capture, const FitOptions& options, Progress& progress,
                  const KnownBeside& beside = {});

}  // namespace crownfit
