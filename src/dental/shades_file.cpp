#include "dental/shades_file.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "base/csv_file.h"
#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"

namespace crownfit {
namespace {

const char* const kShadesFormat = "crownfit-shades/1";

glm::dvec3 Three(const JsonNode& node) {
  const auto v = node.Numbers(size_t{3});
  return {v[0], v[1], v[2]};
}

void RequireNewName(const std::vector<ShadeTab>& tabs, const std::string& name, const std::filesystem::path& file,
                    const std::string& key) {
  if (std::any_of(tabs.begin(), tabs.end(), [&](const ShadeTab& tab) { return tab.name == name; }))
    throw InputError(file, key, "two tabs are called '" + name + "'", "Give each a name of its own.");
}

/// Whether a column's name is that letter, as in "L*", "a" or "CIE b*".
bool IsColumn(const std::string& name, char letter) {
  std::string letters;
  for (const char c : name)
    if (std::isalpha(static_cast<unsigned char>(c))) letters += static_cast<char>(std::tolower(c));
  if (letters.ends_with("star")) letters.resize(letters.size() - 4);
  return letters.ends_with(letter);
}

}  // namespace

bool IsSurfaceColour(const glm::dvec3& lab) {
  return lab.x >= 0 && lab.x <= 105 && std::max(std::abs(lab.y), std::abs(lab.z)) <= 128;
}

std::optional<glm::dvec3> ThreeNumbers(const std::string& text) {
  std::istringstream parts(text);
  const CsvTable with_commas{',', {}};
  glm::dvec3 values;
  int count = 0;
  for (std::string part; std::getline(parts, part, ','); ++count) {
    part.erase(0, std::min(part.size(), part.find_first_not_of(' ')));
    part.erase(part.find_last_not_of(' ') + 1);
    const auto number = with_commas.Number(part);
    if (!number || count == 3) return std::nullopt;
    values[count] = *number;
  }
  return count == 3 ? std::optional(values) : std::nullopt;
}

ShadeSet ReadShades(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root =
      file.RootOfFormat(kShadesFormat, {"made_by", "note", "illuminant", "observer", "tabs", "provenance"});
  // Colours under different illuminants must not be mixed silently.
  root.Require("illuminant").OneOf({"D65"});
  root.Require("observer").OneOf({"2 degrees"});
  ShadeSet set;
  set.made_by = root.Require("made_by").OneOf({"measured", "photographed"});
  if (const auto note = root.Find("note")) set.note = note->String();
  const JsonNode tabs = root.Require("tabs");
  for (const JsonNode& item : tabs.Items()) {
    const JsonObject o(item, {"name", "lab", "stddev"});
    ShadeTab tab;
    tab.name = o.Require("name").String();
    RequireNewName(set.tabs, tab.name, path, o.Require("name").key());
    tab.lab = Three(o.Require("lab"));
    if (!IsSurfaceColour(tab.lab)) o.Require("lab").Fail("is no colour of a surface", "Expected [L*, a*, b*].");
    if (const auto stddev = o.Find("stddev")) tab.stddev = Three(*stddev);
    if (std::min({tab.stddev.x, tab.stddev.y, tab.stddev.z}) < 0) o.Require("stddev").Fail("must not be negative");
    set.tabs.push_back(tab);
  }
  if (set.tabs.empty()) tabs.Fail("has no tab", "Make the file with crownfit shades measured or photographed.");
  return set;
}

void WriteShades(const std::filesystem::path& file, const ShadeSet& set) {
  JsonValue::Array tabs;
  const auto list = [](const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; };
  for (const ShadeTab& tab : set.tabs)
    tabs.push_back(JsonValue::Object{{"name", tab.name}, {"lab", list(tab.lab)}, {"stddev", list(tab.stddev)}});
  JsonValue::Object digests;
  for (const auto& input : set.inputs) digests.emplace_back(input.filename().string(), Sha256OfFile(input));
  WriteTextFile(file, ToJsonText(JsonValue::Object{{"format", kShadesFormat},
                                                   {"made_by", set.made_by},
                                                   {"note", set.note},
                                                   {"illuminant", "D65"},
                                                   {"observer", "2 degrees"},
                                                   {"tabs", tabs},
                                                   {"provenance", JsonValue::Object{{"inputs_sha256", digests}}}}));
}

std::vector<ShadeTab> ReadShadeTable(const std::filesystem::path& file) {
  constexpr double kMostBytes = 16e6;
  const CsvTable table = ReadCsvTable(file, kMostBytes, "A table of shade tabs has a line per tab.");
  std::vector<ShadeTab> tabs;
  for (const CsvTable::Record& record : table.records) {
    const auto& cells = record.cells;
    const std::string key = record.place();
    std::vector<double> values;
    bool all = true;
    for (size_t i = 1; i < cells.size(); ++i) {
      const auto value = table.Number(cells[i]);
      all = all && value && std::abs(*value) < 1e6;
      values.push_back(value.value_or(0.0));
    }
    const bool is_header = &record == &table.records[0] && cells.size() > 3 && !cells[1].empty() &&
                           cells[1].find_first_of("0123456789") == std::string::npos;
    if (is_header && !(IsColumn(cells[1], 'l') && IsColumn(cells[2], 'a') && IsColumn(cells[3], 'b')))
      throw InputError(file, key, "the columns are called " + cells[1] + ", " + cells[2] + ", " + cells[3],
                       "Write name, L*, a*, b* in this order.");
    if (is_header) continue;
    if (!all || (values.size() != 3 && values.size() != 4 && values.size() != 6) || cells[0].empty())
      throw InputError(
          file, key, "expected a name and three, four or six numbers",
          "Write name, L*, a*, b*, then no standard deviation, one for all, or three. Decimal commas need semicolons "
          "between the cells.");
    ShadeTab tab{cells[0], {values[0], values[1], values[2]}, {}};
    if (values.size() == 4) tab.stddev = glm::dvec3(values[3]);
    if (values.size() == 6) tab.stddev = {values[3], values[4], values[5]};
    RequireNewName(tabs, tab.name, file, key);
    if (!IsSurfaceColour(tab.lab) || std::min({tab.stddev.x, tab.stddev.y, tab.stddev.z}) < 0)
      throw InputError(file, key, "has no colour of a surface, or a negative standard deviation",
                       "Expected L* from 0 to 100, a* and b* from -128 to 128.");
    tabs.push_back(tab);
  }
  if (tabs.empty()) throw InputError(file, "", "has no tab", "Write a row per tab: name, L*, a*, b*.");
  return tabs;
}

}  // namespace crownfit
