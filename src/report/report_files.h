#pragma once
// The sources of the report page, beside material.json and run.json: report.json and the pictures in report/.

#include <filesystem>

#include "fit/fit_result.h"

namespace crownfit {

/// Writes both. Their content does not depend on the time, the machine or the number of threads of the fit.
void WriteReportFiles(const std::filesystem::path& folder, const CrownFit& fit);

/// Makes report.html from a result folder: from material.json, run.json, report.json, the pictures and, if present,
/// prediction.json. The folder may have been moved. Returns the page's path. Throws InputError when a file is missing
/// or damaged.
std::filesystem::path WriteReportPage(const std::filesystem::path& folder);

}  // namespace crownfit
