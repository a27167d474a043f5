#pragma once
// The files of a fit's result folder: material.json, run.json, figures/<photograph>.png and the sources of report.html.

#include <filesystem>
#include <string>

#include "fit/fit_result.h"

namespace crownfit {

/// Data of the run that do not depend on the input. They are written to another file, so that material.json stays the
/// same.
struct RunRecord {
  std::string command_line;
  int threads = 0;
  double wall_s = 0;
};

/// Writes everything but the page. Of the result material.json comes last: its presence means that the result is
/// complete. Only the page that shows it follows.
void WriteResult(const std::filesystem::path& folder, const CrownFit& fit, const RunRecord& run);

/// The contract's material.json.
std::string MaterialJson(const CrownFit& fit);

}  // namespace crownfit
