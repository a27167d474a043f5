#include "batch/manifest.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "base/csv_file.h"
#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/limits.h"

namespace crownfit {
namespace {

/// An unparsed row: its place in the file, and its cells by column.
struct RawRow {
  std::string place;
  std::vector<std::pair<std::string, std::vector<std::string>>> cells;
};

std::vector<std::string> Words(std::string text) {
  std::replace(text.begin(), text.end(), ';', ' ');
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

std::vector<RawRow> ReadCsv(const std::filesystem::path& file, const FitCommand& fit) {
  CsvTable table =
      ReadCsvTable(file, std::ldexp(InputLimits().json_MiB, 20), "Split the manifest, or raise CROWNFIT_MAX_JSON_MIB.");
  if (table.records.empty()) throw InputError(file, "", "the manifest is empty", "Begin it with the line: id,capture");
  std::vector<std::string>& header = table.records[0].cells;
  for (std::string& name : header) std::replace(name.begin(), name.end(), '_', '-');
  const auto is_list = [&](const std::string& name) {
    return std::any_of(fit.columns.begin(), fit.columns.end(),
                       [&](const FitColumn& c) { return c.name == name && c.is_list; });
  };
  std::vector<RawRow> rows;
  for (size_t r = 1; r < table.records.size(); ++r) {
    const auto& cells = table.records[r].cells;
    RawRow row{table.records[r].place(), {}};
    for (size_t i = 0; i < header.size(); ++i) {
      const std::string cell = i < cells.size() ? cells[i] : "";
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
    if (cell == raw.cells.end()) {  // the command line's value applies
      for (auto at = fit.defaults.begin(); at != fit.defaults.end();) {
        const auto next = std::find_if(at + 1, fit.defaults.end(), [](const auto& a) { return a.starts_with("--"); });
        if (*at == option) arguments.insert(arguments.end(), at, next);
        at = next;
      }
    } else if (column.is_flag) {
      std::string said = cell->second[0];  // spreadsheets write TRUE
      std::transform(said.begin(), said.end(), said.begin(), [](unsigned char c) { return std::tolower(c); });
      if (said == "true") arguments.push_back(option);
      if (said != "true" && said != "false")
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
  std::set<std::string> lists;
  std::string columns = "id, capture, group";
  for (const FitColumn& c : fit.columns) {
    known.insert(c.name);
    if (c.is_list) lists.insert(c.name);
    columns += ", " + c.name;
  }
  const auto folder = std::filesystem::absolute(file).parent_path();
  std::map<std::string, std::string> place_of_id;
  std::map<std::pair<std::vector<std::string>, std::filesystem::path>, std::string> fault_of;  // parsing costs
  Manifest manifest;
  std::set<std::string> unknown, repeated;
  for (RawRow& raw : raw_rows) {
    ManifestRow row;
    std::string fault, fault_of_list;
    std::set<std::string> seen;
    for (auto& [name, values] : raw.cells) {
      if (name == "prior" && !values.empty() && !values[0].empty()) values[0] = (folder / values[0]).lexically_normal();
      const std::string value = values.empty() ? "" : values[0];
      if (!known.contains(name) && unknown.insert(name).second)
        manifest.faults.push_back(file.string() + ": " + name + ": there is no such column. Known: " + columns);
      if (known.contains(name) && !seen.insert(name).second && repeated.insert(name).second)
        manifest.faults.push_back(file.string() + ": " + name +
                                  ": this column stands twice ('_' counts as '-'); keep one");
      if (values.size() > 1 && known.contains(name) && !lists.contains(name))
        fault_of_list = name + ": expected one value, found " + std::to_string(values.size());
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
      const std::string remedy = RemedyOfMissing(row.capture);
      fault = "capture: " + row.capture.string() + " is neither a capture.json nor a folder that holds one" +
              (remedy.empty() ? "" : ". " + remedy);
    }
    row.arguments = Arguments(raw, fit, fault);
    if (!fault_of_list.empty()) fault = fault_of_list;
    // Only what names a layer's parameter depends on the capture.
    const bool names_parameters = std::any_of(row.arguments.begin(), row.arguments.end(), [](const std::string& a) {
      return a == "--fix" || a == "--free" || a == "--share";
    });
    const std::filesystem::path capture = fault.empty() && is_mine && names_parameters ? row.capture : "";
    const auto [checked, is_new] = fault_of.try_emplace({row.arguments, capture});
    if (is_new) checked->second = fit.fault(row.arguments, capture);
    if (fault.empty()) fault = checked->second;
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
