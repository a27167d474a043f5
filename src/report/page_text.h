#pragma once
// The report page's parts, built in.

#include <string_view>

namespace crownfit {

/// report.html, report.css, report.js of src/report/page, and chart.min.js (Chart.js).
std::string_view PageText(std::string_view name);

}  // namespace crownfit
