#pragma once
// Speed against accuracy for a user: the program itself is run with every configuration of its models.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"

namespace crownfit {

struct TradeOffOptions {
  std::filesystem::path material;  ///< empty: truth.json beside the capture, or else the capture's own values
  int reference_paths = 1024;      ///< per pixel, of the path model as the reference
  bool fits = false;               ///< also fit with every configuration: takes as long as the fits
  int threads = 0;
};

/// One configuration, with the cost and the result of its run.
struct TradeOffRow {
  std::string name, model;
  std::vector<std::string> arguments;  ///< of `crownfit render` or `crownfit fit`
  double cpu_s = 0, wall_s = 0, peak_MiB = 0;
  /// Of rendered photographs against the reference, of fits against the photographs; over 8 x 8 pixel blocks.
  double de00_median = 0, de00_p95 = 0, de00_median_worst = 0;  ///< worst: of one photograph
  std::string status;                                           ///< of the fit; empty for pictures
  /// |ln(fitted / true)| in per cent over the fitted values, and how many 95 % intervals contain the truth; empty
  /// without a truth.
  std::optional<double> error_median_percent, error_largest_percent;
  int intervals = 0, intervals_that_hold = 0;
  std::string fault;  ///< why there are no results; empty when there are
};

struct TradeOff {
  std::vector<TradeOffRow> predictions, fits;
  std::string rendered;                                      ///< whose values were rendered
  std::string fitted_to;                                     ///< reference of fitted values
  double reference_de00_median = 0, reference_de00_p95 = 0;  ///< noise of the reference: one standard deviation
};

/// Runs `program` (this one) once per configuration, one after the other; pictures and results stay in `folder`. Throws
/// InputError.
TradeOff MeasureTradeOff(const std::filesystem::path& program, const std::filesystem::path& capture,
                         const TradeOffOptions& options, const std::filesystem::path& folder, Progress& progress);

}  // namespace crownfit
