#pragma once
// What the batch keeps beside a crown's result: what it was made of, so that a second run knows whether it still holds,
// and what the summary shows of it, so that the summary reads one small file a crown.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/json_file.h"

namespace crownfit {

struct RecordedFile {
  std::string name;  ///< relative to the capture's folder
  std::string sha256;
  std::string stamp;  ///< size and time of change; while these stay, the content is taken as the same
};

struct RecordedParameter {
  std::string name, status;  ///< "dentine.absorption_per_mm[R]"
  double value = 0;
  std::optional<double> stddev, low, high;  ///< where it was fitted
};

struct CrownRecord {
  std::string program;                 ///< version
  std::vector<std::string> arguments;  ///< of `crownfit fit`
  std::vector<RecordedFile> files;
  std::string status;  ///< of material.json
  std::vector<std::string> reasons;
  std::optional<double> de00_median, de00_p95, holdout_de00_median;  ///< none without photographs
  double wall_s = 0, peak_MiB = 0;
  std::string picture;  ///< relative to the crown's folder; empty when there is none
  std::vector<RecordedParameter> parameters;
};

inline constexpr const char* kRecordName = "crown.json";

/// From a finished result. Throws InputError when an input changed after `begun_s` (Unix time), when its fit began.
CrownRecord RecordOf(const std::filesystem::path& result, const std::filesystem::path& capture_folder,
                     const std::vector<std::string>& arguments, double begun_s);
std::string RecordText(const CrownRecord& record);  ///< of crown.json
/// Nothing when there is none, or none that this program wrote whole.
std::optional<CrownRecord> ReadRecord(const std::filesystem::path& file);

enum class Freshness {
  kStale,     ///< inputs, options or program are others
  kFresh,     ///< every file as it was
  kRestamped  ///< the same content under a new stamp, now in the record
};
Freshness Compare(CrownRecord& record, const std::filesystem::path& capture_folder,
                  const std::vector<std::string>& arguments);

}  // namespace crownfit
