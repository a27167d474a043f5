#include "dental/shades_file.h"

#include <algorithm>
#include <cctype>
#include <cstring>
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

/// A column's name without capitals, blanks, brackets and the asterisk.
std::string Plain(const std::string& name) {
  std::string plain;
  for (const char c : name)
    if (!std::strchr(" *_-.()[]", c)) plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (plain.ends_with("star")) plain.resize(plain.size() - 4);
  return plain;
}

/// What a column holds. The three coordinates and their standard deviations stand in the order of the numbers of a
/// table without a heading.
enum class Column { kL, kA, kB, kStddevL, kStddevA, kStddevB, kStddev, kName };
constexpr const char* kColumnNames[] = {"L*", "a*", "b*", "sL", "sa", "sb", "stddev", "name"};

/// Absent where the name is not known. Names are compared as a whole: "Hunter L" and "dL*" are no L*.
std::optional<Column> ColumnNamed(const std::string& name) {
  std::string plain = Plain(name);
  for (const char* known : {"name", "shade", "tab", "farbe"})
    if (plain == known) return Column::kName;
  const auto remove = [&](const std::string& word, bool at_end) {
    if (!(at_end ? plain.ends_with(word) : plain.starts_with(word))) return false;
    plain.erase(at_end ? plain.size() - word.size() : 0, word.size());
    return true;
  };
  bool is_stddev = false;
  for (const char* word : {"standarddeviation", "stddev", "stdev", "std", "sd", "\u03c3"})
    if (!is_stddev) is_stddev = remove(word, false) || remove(word, true);
  if (is_stddev) remove("of", false);
  if (is_stddev && plain.empty()) return Column::kStddev;
  if (!is_stddev && plain.size() == 2 && plain[0] == 's') is_stddev = remove("s", false);
  for (const char* word : {"cielab", "cie"})
    if (remove(word, false)) break;
  const size_t at = plain.size() == 1 ? std::string("lab").find(plain[0]) : std::string::npos;
  if (at == std::string::npos) return std::nullopt;
  return static_cast<Column>(at + (is_stddev ? 3 : 0));
}

/// Where a row's cells stand.
struct Columns {
  std::optional<size_t> of[8];
  size_t count = 0;
  std::optional<size_t>& operator[](Column c) { return of[static_cast<size_t>(c)]; }
};

constexpr const char* kHowToName = "Known columns: name, L*, a*, b*, and stddev or sL, sa, sb.";

[[noreturn]] void RefuseColumn(const std::filesystem::path& file, const std::string& place, const std::string& name) {
  const std::string plain = Plain(name), column = "column '" + name + "'";
  if (name.empty()) throw InputError(file, place, "a column has no name", kHowToName);
  if (plain.find("hunter") != std::string::npos)
    throw InputError(file, place, column + " is in Hunter's coordinates, which are not CIELAB",
                     "Let the instrument give L*, a*, b* of CIELAB.");
  for (const char* difference : {"\u0394", "\u03b4", "\u2206", "delta", "d"})
    for (const char* of : {"l", "a", "b", "c", "h", "e", "e00", "e76", "e94", "eab"})
      if (plain == std::string(difference) + of)
        throw InputError(file, place, column + " holds differences between colours",
                         "Remove the column. The table needs each tab's own L*, a*, b*.");
  throw InputError(file, place, column + " is not known", std::string("Remove the column. ") + kHowToName);
}

Columns ColumnsOf(const std::filesystem::path& file, const CsvTable::Record& heading) {
  Columns columns;
  const auto& names = heading.cells;
  for (columns.count = names.size(); names[columns.count - 1].empty();) --columns.count;
  const bool has_name_column = std::any_of(names.begin(), names.end(),
                                           [](const std::string& name) { return ColumnNamed(name) == Column::kName; });
  for (size_t i = 0; i < columns.count; ++i) {
    auto column = ColumnNamed(names[i]);
    if (i == 0 && !column && !has_name_column) column = Column::kName;  // in the user's own words
    if (!column) RefuseColumn(file, heading.place(), names[i]);
    if (columns[*column])
      throw InputError(file, heading.place(),
                       "columns '" + names[*columns[*column]] + "' and '" + names[i] + "' mean the same",
                       "Remove one of them.");
    columns[*column] = i;
  }
  const bool by_coordinate = columns[Column::kStddevL] || columns[Column::kStddevA] || columns[Column::kStddevB];
  if (by_coordinate && columns[Column::kStddev])
    throw InputError(file, heading.place(), "there is a standard deviation for all, and one of each coordinate",
                     "Remove the column '" + names[*columns[Column::kStddev]] + "'.");
  for (const Column needed :
       {Column::kName, Column::kL, Column::kA, Column::kB, Column::kStddevL, Column::kStddevA, Column::kStddevB})
    if (!columns[needed] && (by_coordinate || needed < Column::kStddevL || needed == Column::kName))
      throw InputError(file, heading.place(),
                       std::string("there is no column ") + kColumnNames[static_cast<size_t>(needed)], kHowToName);
  return columns;
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
  constexpr const char* kDecimalCommas = "Decimal commas need semicolons between the cells.";
  const CsvTable table = ReadCsvTable(file, kMostBytes, "A table of shade tabs has a line per tab.");
  std::vector<ShadeTab> tabs;
  std::optional<Columns> named;
  for (const CsvTable::Record& record : table.records) {
    auto cells = record.cells;
    const std::string key = record.place();
    const auto is_number = [&](const std::string& cell) { return table.Number(cell).has_value(); };
    const auto has_letter = [](const std::string& cell) {
      return std::any_of(cell.begin(), cell.end(), [](unsigned char c) { return std::isalpha(c); });
    };
    if (&record == &table.records[0] && std::any_of(cells.begin() + 1, cells.end(), has_letter) &&
        std::none_of(cells.begin() + 1, cells.end(), is_number)) {
      named = ColumnsOf(file, record);
      continue;
    }
    while (cells.size() > (named ? named->count : 1) && cells.back().empty()) cells.pop_back();
    if (named && cells.size() != named->count)
      throw InputError(
          file, key,
          "has " + std::to_string(cells.size()) + " cells, but the heading names " + std::to_string(named->count),
          kDecimalCommas);
    Columns columns = named.value_or(Columns());
    if (!named) {
      if (cells.size() != 4 && cells.size() != 7)
        throw InputError(file, key, "expected a name and three or six numbers",
                         std::string("Write name, L*, a*, b*, then no standard deviation or three; or name the columns "
                                     "in the first line, such as name,L,a,b,stddev. ") +
                             kDecimalCommas);
      if (cells.size() == 7 && table.separator == ',' &&
          std::none_of(cells.begin() + 1, cells.end(), [](const std::string& c) { return c.find('.') != c.npos; }))
        throw InputError(file, key, "six whole numbers may be three numbers with decimal commas",
                         std::string("Name the columns in the first line: name,L,a,b,sL,sa,sb. ") + kDecimalCommas);
      columns[Column::kName] = 0;
      for (size_t i = 1; i < cells.size(); ++i) columns.of[i - 1] = i;
    }
    double values[7] = {};
    for (size_t i = 0; i < std::size(values); ++i) {
      if (!columns.of[i]) continue;
      const std::string& cell = cells[*columns.of[i]];
      const auto value = table.Number(cell);
      if (!value || std::abs(*value) >= 1e6)
        throw InputError(file, key, std::string("expected a number as ") + kColumnNames[i] + ", found '" + cell + "'",
                         cell.empty()                          ? "Fill the cell. A tab needs name, L*, a*, b*."
                         : cell.find(',') != std::string::npos ? kDecimalCommas
                                                               : "Write plain numbers without a unit.");
      values[i] = *value;
    }
    ShadeTab tab{cells[*columns[Column::kName]], {values[0], values[1], values[2]}, {values[3], values[4], values[5]}};
    if (columns[Column::kStddev]) tab.stddev = glm::dvec3(values[6]);
    if (tab.name.empty()) throw InputError(file, key, "the tab has no name", "Give each tab a name.");
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
