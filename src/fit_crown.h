#pragma once
// The main job.

#include "base/progress.h"
#include "fit/fit_result.h"

namespace crownfit {

/// Fits the material of one capture. Never prints; how far it has come is shown by `progress`. Throws InputError.
CrownFit FitCrown(const Capture& capture, const FitOptions& options, Progress& progress,
                  const KnownBeside& beside = {});

}  // namespace crownfit
