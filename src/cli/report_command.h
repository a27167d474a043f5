#pragma once
// `crownfit report`, and the result files of `fit`.

#include "base/progress.h"
#include "report/result_files.h"

namespace crownfit {

/// Writes a fit's result and the page that shows it, with the material as a flat piece over black.
void WriteResultWithPage(const std::filesystem::path& folder, const CrownFit& fit, const RunRecord& run, int threads,
                         Progress& progress);

}  // namespace crownfit
