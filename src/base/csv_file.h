#pragma once
// Text tables: RFC 4180, and what spreadsheets make of it.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

/// A table's records in order, without those that hold nothing but separators. Cells stand without blanks around them.
struct CsvTable {
  struct Record {
    size_t line;  ///< where it begins, from 1
    std::vector<std::string> cells;
    std::string place() const { return "line " + std::to_string(line); }
  };
  char separator = ',';
  std::vector<Record> records;

  /// The number that a whole cell holds. A comma is its decimal point where commas do not separate cells, as in German
  /// spreadsheets. Nothing where it is no number.
  std::optional<double> Number(const std::string& cell) const;
};

/// Reads cells between commas, semicolons or tabs: as a first line "sep=;" states, which is no record; else whichever
/// stands in the first record, semicolons before the others.
/// Cells in double quotes may hold separators, line ends and doubled quotes. Lines end with LF, CR LF or CR. Throws
/// InputError: no UTF-8, a quotation mark where none may stand, more than `most_bytes` (`remedy` says what to do then).
CsvTable ReadCsvTable(const std::filesystem::path& file, double most_bytes, const std::string& remedy);

}  // namespace crownfit
