#include "base/csv_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "base/error.h"
#include "base/files.h"

namespace crownfit {
namespace {

/// Bytes of the UTF-8 character that begins at `at`; 0 where none does (Unicode 15, table 3-7, without its limits on
/// second bytes: what they exclude no program writes).
size_t CharacterLength(const std::string& text, size_t at) {
  const auto byte = static_cast<unsigned char>(text[at]);
  const size_t length = byte < 0x80                   ? 1
                        : byte >= 0xC2 && byte < 0xE0 ? 2
                        : byte >= 0xE0 && byte < 0xF0 ? 3
                        : byte >= 0xF0 && byte < 0xF5 ? 4
                                                      : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (size_t k = 1; k < length; ++k)
    if ((static_cast<unsigned char>(text[at + k]) & 0xC0) != 0x80) return 0;
  return length;
}

void RequireUtf8(const std::filesystem::path& file, const std::string& text) {
  constexpr const char* kRemedy = "Save it as \"CSV UTF-8\" in the spreadsheet.";
  if (text.find('\0') != std::string::npos)
    throw InputError(file, "", "is not a UTF-8 text; it may be UTF-16", kRemedy);
  size_t line = 1;
  for (size_t at = 0; at < text.size();) {
    const size_t length = CharacterLength(text, at);
    if (length == 0)
      throw InputError(file, "line " + std::to_string(line), "is not UTF-8; it may be Latin-1 or Windows-1252",
                       kRemedy);
    if (text[at] == '\n' || (text[at] == '\r' && text.compare(at, 2, "\r\n") != 0)) ++line;
    at += length;
  }
}

class Reader {
 public:
  Reader(const std::filesystem::path& file, const std::string& text) : file_(file), text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  CsvTable Read() {
    CsvTable table;
    separator_ = table.separator = StatedSeparator().value_or(Separator());
    while (at_ < text_.size()) {
      CsvTable::Record record{line_, {}};
      while (ReadCell(record.cells)) {
      }
      const bool is_empty =
          std::all_of(record.cells.begin(), record.cells.end(), [](const std::string& c) { return c.empty(); });
      if (!is_empty) table.records.push_back(std::move(record));
    }
    return table;
  }

 private:
  [[noreturn]] void Refuse(const std::string& what) const {
    throw InputError(
        file_, "line " + std::to_string(line_), what,
        "Put cells that hold separators or quotation marks into \"...\", and write \"\" for a quotation mark.");
  }

  /// Takes Excel's first line "sep=;", which states the separator.
  std::optional<char> StatedSeparator() {
    const size_t end = std::min(text_.find_first_of("\r\n", at_), text_.size());
    std::string line = text_.substr(at_, end - at_);
    if (line.size() > 1 && line.starts_with('"') && line.ends_with('"')) line = line.substr(1, line.size() - 2);
    if (!line.starts_with("sep=")) return std::nullopt;
    if (line.size() != 5 || std::string(",;\t").find(line[4]) == std::string::npos)
      throw InputError(file_, "line 1", "'" + line + "' states a separator that is not read",
                       "Separate cells by commas, semicolons or tabs.");
    at_ = end;
    TakeEndOfLine();
    return line[4];
  }

  /// Of the first line that holds anything, outside of quotes.
  char Separator() const {
    bool quoted = false, has_tab = false, has_comma = false;
    for (size_t i = at_; i < text_.size(); ++i) {
      const char c = text_[i];
      if (c == '"') quoted = !quoted;
      if (quoted) continue;
      if (c == ';') return ';';
      has_tab |= c == '\t', has_comma |= c == ',';
      if ((c == '\n' || c == '\r') && (has_tab || has_comma)) break;
    }
    return has_tab && !has_comma ? '\t' : ',';
  }

  bool IsAt(char c) const { return at_ < text_.size() && text_[at_] == c; }
  bool IsAtEndOfLine() const { return at_ >= text_.size() || IsAt('\n') || IsAt('\r'); }
  void SkipBlanks() {
    while (IsAt(' ') || (IsAt('\t') && separator_ != '\t')) ++at_;
  }
  /// Takes a line's end, which counts.
  void TakeEndOfLine() {
    if (at_ < text_.size()) at_ += text_.compare(at_, 2, "\r\n") == 0 ? 2 : 1;
    ++line_;
  }

  std::string QuotedCell() {
    const size_t begin = line_;
    std::string cell;
    for (++at_;; ++at_) {
      if (at_ >= text_.size()) {
        line_ = begin;
        Refuse("a cell in quotation marks is never closed");
      }
      if (IsAtEndOfLine()) {
        TakeEndOfLine();
        --at_;
        cell += '\n';
      } else if (!IsAt('"')) {
        cell += text_[at_];
      } else if (text_.compare(at_, 2, "\"\"") == 0) {
        cell += text_[++at_];
      } else {
        ++at_;
        break;
      }
    }
    SkipBlanks();
    if (!IsAt(separator_) && !IsAtEndOfLine()) Refuse("text follows a cell's closing quotation mark");
    return cell;
  }

  std::string PlainCell() {
    const size_t begin = at_;
    for (; !IsAt(separator_) && !IsAtEndOfLine(); ++at_)
      if (IsAt('"')) Refuse("a quotation mark stands inside a cell");
    size_t end = at_;
    while (end > begin && (text_[end - 1] == ' ' || text_[end - 1] == '\t')) --end;
    return text_.substr(begin, end - begin);
  }

  /// False after a record's last cell.
  bool ReadCell(std::vector<std::string>& cells) {
    SkipBlanks();
    cells.push_back(IsAt('"') ? QuotedCell() : PlainCell());
    if (IsAt(separator_)) {
      ++at_;
      return true;
    }
    TakeEndOfLine();
    return false;
  }

  const std::filesystem::path& file_;
  const std::string& text_;
  size_t at_ = 0, line_ = 1;
  char separator_ = ',';
};

}  // namespace

std::optional<double> CsvTable::Number(const std::string& cell) const {
  std::string text = cell;
  for (const char* minus : {"\u2212", "\u2013"})  // as word processors write it
    if (text.starts_with(minus)) text.replace(0, 3, "-");
  if (separator != ',' && std::count(text.begin(), text.end(), ',') == 1 && text.find('.') == std::string::npos)
    std::replace(text.begin(), text.end(), ',', '.');
  const char* begin = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(begin, text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

CsvTable ReadCsvTable(const std::filesystem::path& file, double most_bytes, const std::string& remedy) {
  const std::string text = ReadWholeFile(file, most_bytes, remedy);
  RequireUtf8(file, text);
  return Reader(file, text).Read();
}

}  // namespace crownfit
