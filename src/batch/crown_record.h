#pragma once
// What the batch stores beside a crown's result. Its inputs show a later run whether the result is still valid. Its
// values let the summary read one small file per crown.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_file.h"

namespace crownfit {

struct RecordedFile {
  std::string name;  ///< relative to the capture's folder
  std::string sha256;
  std::string stamp;  ///< size and time of change; while these stay, the content counts as unchanged
};

struct RecordedParameter {
  std::string name, status;  ///< "dentine.absorption_per_mm[R]"
  double value = 0;
  std::optional<double> stddev, low, high;  ///< if it was fitted
};

struct CrownRecord {
  std::string program;                 ///< version
  std::vector<std::string> arguments;  ///< of `crownfit fit`
  std::vector<RecordedFile> files;
  std::string status;  ///< from material.json
  std::vector<std::string> reasons;
  std::optional<double> de00_median, de00_p95, holdout_de00_median;  ///< absent without photographs
  double wall_s = 0, peak_MiB = 0;
  std::string picture;  ///< relative to the crown's folder; empty when there is none
  std::vector<RecordedParameter> parameters;
};

inline constexpr const char* kRecordName = "crown.json";

/// Record of a finished result. Throws InputError when an input changed after `begun_s` (Unix time), the start of its
/// fit.
CrownRecord RecordOf(const std::filesystem::path& result, const std::filesystem::path& capture_folder,
                     const std::vector<std::string>& arguments, double begun_s);
std::string RecordText(const CrownRecord& record);  ///< the text of crown.json
/// Absent when there is no record, or none that this program wrote completely.
std::optional<CrownRecord> ReadRecord(const std::filesystem::path& file);

enum class Freshness {
  kStale,     ///< inputs, options or program differ
  kFresh,     ///< every file is unchanged
  kRestamped  ///< same content under a new stamp, which the record now has
};
Freshness Compare(CrownRecord& record, const std::filesystem::path& capture_folder,
                  const std::vector<std::string>& arguments);

}  // namespace crownfit
