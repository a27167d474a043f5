#pragma once
// What the report page is made from, beside material.json and run.json: report.json and the pictures in report/.

#include <filesystem>

#include "fit/fit_result.h"

namespace crownfit {

/// Writes both. Nothing in them depends on when, on which machine or with how many threads the fit ran.
void WriteReportFiles(const std::filesystem::path& folder, const CrownFit& fit);

/// Makes report.html from material.json, run.json, report.json, the pictures and, if there, prediction.json of a result
/// folder, wherever that was moved to. Returns its path. Throws InputError when something of it is missing or damaged.
std::filesystem::path WriteReportPage(const std::filesystem::path& folder);

}  // namespace crownfit
