#pragma once
// The summary of a batch for a lab: one row per crown, and statistics over the crowns of a group.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "batch/crown_record.h"
#include "batch/manifest.h"

namespace crownfit {

enum class CrownState { kWaiting, kFaulty, kFailed, kFitted };

/// One row of the manifest and its outcome.
struct CrownOutcome {
  ManifestRow row;
  CrownState state = CrownState::kWaiting;
  std::string reason;                 ///< of a fault or failure
  std::optional<CrownRecord> record;  ///< of a fitted one
  bool usable() const { return state == CrownState::kFitted && record->status == "usable"; }
};

/// "usable", "not_usable", ... of fitted ones; "faulty", "failed", "waiting".
std::string StatusOf(const CrownOutcome& crown);

/// Statistics over the usable crowns of a group in which a parameter was fitted.
struct GroupStatistics {
  std::string group, parameter;
  size_t number = 0;
  double mean = 0, error_of_mean = 0;  ///< weighted by 1 / stddev^2; the error is inflated where crowns differ by more
  double spread = 0;                   ///< standard deviation over crowns
  double median = 0, robust_spread = 0;  ///< 1.4826 x median absolute deviation
};
std::vector<GroupStatistics> StatisticsOf(std::span<const CrownOutcome> crowns);

/// What a person should look at, per crown: "not usable", "image error", "at bound: NAME", "outlier: NAME".
std::vector<std::vector<std::string>> FlagsOf(std::span<const CrownOutcome> crowns,
                                              std::span<const GroupStatistics> statistics);

// The first three contain no times: they are the same whenever and wherever the batch ran.
std::string SummaryCsv(std::span<const CrownOutcome> crowns);
std::string StatisticsCsv(std::span<const GroupStatistics> statistics);
std::string SummaryHtml(std::span<const CrownOutcome> crowns);
std::string TimesCsv(std::span<const CrownOutcome> crowns);

}  // namespace crownfit
