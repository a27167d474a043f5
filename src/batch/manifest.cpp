#include "batch/manifest.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/limits.h"

namespace crownfit {
namespace {

/// A row before it is understood: its place in the file, and its cells by column.
struct RawRow {
  std::string place;
  std::vector<std::pair<std::string, std::vector<std::string>>> cells;
};

/// RFC 4180: cells in double quotes may hold separators, line ends and doubled quotes.
class CsvReader {
 public:
  explicit CsvReader(const std::filesystem::path& file) : file_(file) {
    text_ = ReadWholeFile(file, std::ldexp(InputLimits().json_MiB, 20),
                          "Split the manifest, or raise CROWNFIT_MAX_JSON_MIB.");
    if (text_.find('\0') != std::string::npos)
      throw InputError(file, "", "is not a UTF-8 text; it may be UTF-16", "Save it as CSV in UTF-8.");
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = 3;
    const std::string header = text_.substr(at_, text_.find('\n', at_) - at_);
    if (header.find(',') == std::string::npos && header.find(';') != std::string::npos) separator_ = ';';
  }
  /// False at the end. `line`: where the record begins.
  bool Next(std::vector<std::string>& cells, size_t& line) {
    do {
      cells.assign(1, "");
      line = line_;
      if (at_ >= text_.size()) return false;
      ReadRecord(cells);
    } while (cells.size() == 1 && cells[0].empty());
    return true;
  }

 private:
  void ReadRecord(std::vector<std::string>& cells) {
    bool quoted = false;
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '\n') ++line_;
      if (quoted) {
        if (c != '"') {
          cells.back() += c;
        } else if (at_ + 1 < text_.size() && text_[at_ + 1] == '"') {
          cells.back() += text_[++at_];
        } else {
          quoted = false;
        }
      } else if (c == '"' && cells.back().empty()) {
        quoted = true;
      } else if (c == separator_) {
        cells.emplace_back();
      } else if (c == '\n') {
        ++at_;
        return;
      } else if (c != '\r') {
        cells.back() += c;
      }
    }
    if (quoted)
      throw InputError(file_, "", "a cell in quotation marks is never closed", "Look for an unpaired \" in the file.");
  }
  std::filesystem::path file_;
  std::string text_;
  size_t at_ = 0, line_ = 1;
  char separator_ = ',';
};

std::string Trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

std::vector<std::string> Words(std::string text) {
  std::replace(text.begin(), text.end(), ';', ' ');
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::vector<RawRow> ReadCsv(const std::filesystem::path& file, const FitCommand& fit) {
  CsvReader reader(file);
  std::vector<std::string> header, cells;
  size_t line = 0;
  if (!reader.Next(header, line))
    throw InputError(file, "", "the manifest is empty", "Begin it with the line: id,capture");
  std::vector<RawRow> rows;
  for (std::string& name : header) {
    name = Trimmed(name);
    std::replace(name.begin(), name.end(), '_', '-');
  }
  const auto is_list = [&](const std::string& name) {
    return std::any_of(fit.columns.begin(), fit.columns.end(),
                       [&](const FitColumn& c) { return c.name == name && c.is_list; });
  };
  while (reader.Next(cells, line)) {
    RawRow row{"line " + std::to_string(line), {}};
    for (size_t i = 0; i < header.size(); ++i) {
      const std::string cell = i < cells.size() ? Trimmed(cells[i]) : "";
      row.cells.emplace_back(header[i], is_list(header[i]) ? Words(cell)
                                        : cell.empty()     ? std::vector<std::string>()
                                                           : std::vector<std::string>{cell});
    }
    if (cells.size() > header.size()) row.cells.emplace_back("(more cells than columns)", std::vector<std::string>{""});
    rows.push_back(row);
  }
  return rows;
}

std::string TextOf(const JsonNode& node, const JsonValue& value) {
  if (const auto* text = std::get_if<std::string>(&value.data)) return *text;
  if (const auto* flag = std::get_if<bool>(&value.data)) return *flag ? "true" : "false";
  if (!std::holds_alternative<double>(value.data))
    node.Fail("expected text, a number, true or false, or a list of them");
  std::string text = ToJsonText(value);
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

std::vector<RawRow> ReadJson(const std::filesystem::path& file) {
  const JsonFile json(file);
  const JsonObject root = json.RootOfFormat("crownfit-manifest/1", {"crowns"});
  const auto& members = std::get<JsonValue::Object>(json.value.data);
  const auto crowns = std::find_if(members.begin(), members.end(), [](const auto& m) { return m.first == "crowns"; });
  std::vector<RawRow> rows;
  for (const JsonNode& node : root.Require("crowns").Items()) {
    RawRow row{node.key(), {}};
    if (!node.IsObject()) node.Fail("expected an object with id and capture");
    const auto& object = std::get<JsonValue::Object>(std::get<JsonValue::Array>(crowns->second.data)[rows.size()].data);
    for (const auto& [name, value] : object) {
      std::vector<std::string> texts;
      if (const auto* list = std::get_if<JsonValue::Array>(&value.data)) {
        for (const JsonValue& item : *list) texts.push_back(TextOf(node, item));
      } else {
        texts.push_back(TextOf(node, value));
      }
      std::string column = name;
      std::replace(column.begin(), column.end(), '_', '-');
      row.cells.emplace_back(column, texts);
    }
    rows.push_back(row);
  }
  return rows;
}

/// An id is a folder's name.
bool IsGoodId(const std::string& id) {
  return !id.empty() && id.size() <= 100 && id.front() != '.' && id.front() != '-' &&
         std::all_of(id.begin(), id.end(),
                     [](unsigned char c) { return std::isalnum(c) || c == '.' || c == '-' || c == '_'; });
}

/// The arguments of a row, or what is wrong with a cell.
std::vector<std::string> Arguments(const RawRow& raw, const FitCommand& fit, std::string& fault) {
  std::vector<std::string> arguments;
  for (const FitColumn& column : fit.columns) {
    const auto cell = std::find_if(raw.cells.begin(), raw.cells.end(),
                                   [&](const auto& c) { return c.first == column.name && !c.second.empty(); });
    const std::string option = "--" + column.name;
    if (cell == raw.cells.end()) {  // as the command line says for all
      for (auto at = fit.defaults.begin(); at != fit.defaults.end();) {
        const auto next = std::find_if(at + 1, fit.defaults.end(), [](const auto& a) { return a.starts_with("--"); });
        if (*at == option) arguments.insert(arguments.end(), at, next);
        at = next;
      }
    } else if (column.is_flag) {
      if (cell->second[0] == "true") arguments.push_back(option);
      if (cell->second[0] != "true" && cell->second[0] != "false")
        fault = column.name + ": expected true or false, found '" + cell->second[0] + "'";
    } else {
      for (const std::string& value : cell->second) arguments.insert(arguments.end(), {option, value});
    }
  }
  return arguments;
}

}  // namespace

Manifest ReadManifest(const std::filesystem::path& file, const FitCommand& fit, const std::optional<Shard>& only) {
  std::vector<RawRow> raw_rows = file.extension() == ".json" ? ReadJson(file) : ReadCsv(file, fit);
  if (raw_rows.empty()) throw InputError(file, "", "the manifest lists no crown", "Give it one row per crown.");
  std::set<std::string> known{"id", "capture", "group"};
  std::string columns = "id, capture, group";
  for (const FitColumn& c : fit.columns) {
    known.insert(c.name);
    columns += ", " + c.name;
  }
  const auto folder = std::filesystem::absolute(file).parent_path();
  std::map<std::string, std::string> place_of_id;
  std::map<std::vector<std::string>, std::string> fault_of_arguments;  // few differ, and parsing costs
  Manifest manifest;
  std::set<std::string> unknown;
  for (RawRow& raw : raw_rows) {
    ManifestRow row;
    std::string fault;
    for (auto& [name, values] : raw.cells) {
      if (name == "prior" && !values.empty() && !values[0].empty()) values[0] = (folder / values[0]).lexically_normal();
      const std::string value = values.empty() ? "" : values[0];
      if (!known.contains(name) && unknown.insert(name).second)
        manifest.faults.push_back(file.string() + ": " + name + ": there is no such column. Known: " + columns);
      if (name == "id") row.id = value;
      if (name == "group") row.group = value;
      if (name == "capture" && !value.empty()) row.capture = (folder / value).lexically_normal();
    }
    const bool is_mine = !only || only->Has(manifest.rows.size(), raw_rows.size());
    const auto first = place_of_id.emplace(row.id, raw.place);
    std::error_code ignored;
    if (!IsGoodId(row.id)) {
      fault = "id: '" + row.id + "' can't name a folder; use at most 100 letters, digits, '.', '-' and '_'";
    } else if (!first.second) {
      fault = "id: '" + row.id + "' occurs twice; the first is " + first.first->second;
    } else if (row.capture.empty()) {
      fault = "capture: no folder is named";
    } else if (is_mine && !std::filesystem::is_regular_file(row.capture, ignored) &&
               !std::filesystem::is_regular_file(row.capture / "capture.json", ignored)) {
      fault = "capture: " + row.capture.string() + " is neither a capture.json nor a folder that holds one";
    }
    row.arguments = Arguments(raw, fit, fault);
    const auto checked = fault_of_arguments.find(row.arguments);
    std::string of_arguments = checked != fault_of_arguments.end()
                                   ? checked->second
                                   : fault_of_arguments[row.arguments] = fit.fault(row.arguments);
    if (fault.empty()) fault = of_arguments;
    if (!fault.empty()) row.fault = file.string() + ": " + raw.place + ": " + fault;
    manifest.rows.push_back(row);
  }
  return manifest;
}

std::string Manifest::AllFaults() const {
  std::string all;
  for (const std::string& fault : faults) all += (all.empty() ? "" : "\n") + fault;
  for (const ManifestRow& row : rows)
    if (!row.fault.empty()) all += (all.empty() ? "" : "\n") + row.fault;
  return all;
}

}  // namespace crownfit
