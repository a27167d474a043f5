#pragma once
// The list of crowns to fit: CSV or JSON, one row per crown.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

/// An option of `crownfit fit` that a manifest may have as a column, without its dashes.
struct FitColumn {
  std::string name;
  bool is_flag = false;  ///< cells: true or false
  bool is_list = false;  ///< cells: values separated by spaces or semicolons
};

/// What the batch needs to know of the fit's command line.
struct FitCommand {
  std::vector<FitColumn> columns;
  std::vector<std::string> defaults;  ///< arguments of every row that does not set that option itself
  /// What is wrong with arguments, empty when nothing is; where a capture is named, for that capture.
  std::function<std::string(const std::vector<std::string>& arguments, const std::filesystem::path& capture)> fault;
};

struct ManifestRow {
  std::string id, group;
  std::filesystem::path capture;
  std::vector<std::string> arguments;  ///< of `crownfit fit`, in the order of its options
  std::string fault;                   ///< why it can't be fitted; names file, line and column
};

/// A part of a batch that runs beside others, each on its own crowns.
struct Shard {
  size_t number = 1, count = 1;  ///< counted from 1
  std::string Name() const { return "shard-" + std::to_string(number) + "-of-" + std::to_string(count); }
  bool Has(size_t row, size_t rows) const { return row >= rows * (number - 1) / count && row < rows * number / count; }
};

struct Manifest {
  std::vector<ManifestRow> rows;
  std::vector<std::string> faults;  ///< of no single row, such as an unknown column
  std::string AllFaults() const;    ///< one per line; empty when there is none
};

/// Reads *.csv (csv_file.h; header `id,capture`, then any of `group` and the options) or *.json
/// ("crownfit-manifest/1"). Captures are relative to the manifest. Only those of the shard `only` are looked up on
/// disk, so that not every task searches a shared folder for all. Errors in a row become its fault; errors of the file
/// are thrown as InputError.
Manifest ReadManifest(const std::filesystem::path& file, const FitCommand& fit, const std::optional<Shard>& only = {});

}  // namespace crownfit
