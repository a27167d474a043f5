#pragma once
// A laboratory's own shade tabs, as it has measured or photographed them ("crownfit-shades/1").

#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

struct ShadeTab {
  std::string name;
  glm::dvec3 lab{0.0}, stddev{0.0};  ///< CIELAB, D65, 2 degrees
};

struct ShadeSet {
  std::string made_by;                        ///< "measured" or "photographed"
  std::string note;                           ///< how: instrument, geometry, date
  std::vector<std::filesystem::path> inputs;  ///< whose digests the file keeps; not read back
  std::vector<ShadeTab> tabs;
};

/// Throws InputError.
ShadeSet ReadShades(const std::filesystem::path& file);
void WriteShades(const std::filesystem::path& file, const ShadeSet& set);

/// A table of rows `name, L*, a*, b*`, and for the standard deviations nothing, one number, or three; separated by
/// commas or semicolons; a first line that holds no numbers is a header, which names these columns. Throws InputError.
std::vector<ShadeTab> ReadShadeTable(const std::filesystem::path& file);

/// Within limits beyond any surface's colour: a column in the wrong place, or a percentage, is noticed.
bool IsSurfaceColour(const glm::dvec3& lab);

/// Three numbers between commas, or nothing.
std::optional<glm::dvec3> ThreeNumbers(const std::string& text);

}  // namespace crownfit
