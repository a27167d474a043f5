#pragma once
// What a fit leaves in its folder: material.json, run.json, figures/<photograph>.png and what report.html is made from.

#include <filesystem>
#include <string>

#include "fit/fit_result.h"

namespace crownfit {

/// What depends on the run and not on the input; written beside the material so that material.json stays the same.
struct RunRecord {
  std::string command_line;
  int threads = 0;
  double wall_s = 0;
};

/// Writes everything but the page. Of the result material.json comes last, so that its presence says the result is
/// whole; only the page that shows it follows.
void WriteResult(const std::filesystem::path& folder, const CrownFit& fit, const RunRecord& run);

/// The contract's material.json.
std::string MaterialJson(const CrownFit& fit);

}  // namespace crownfit
