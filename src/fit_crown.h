#pragma once
// The main job.

#include "base/progress.h"
#include "report/crown_fit.h"

namespace crownfit {

/// What fits of other captures of the same material know, and where to start from. Both in the order of the free
/// entries, or empty.
struct KnownBeside {
  EntryKnowledge others;
  Eigen::VectorXd start;
};

/// Fits the material of one capture. Never prints; how far it has come is shown by `progress`. Throws InputError.
CrownFit FitCrown(const Capture& capture, const FitOptions& options, Progress& progress,
                  const KnownBeside& beside = {});

}  // namespace crownfit
