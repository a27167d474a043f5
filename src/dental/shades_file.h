#pragma once
// A laboratory's own shade tabs, measured or photographed ("crownfit-shades/1").

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
  std::vector<std::filesystem::path> inputs;  ///< their digests are written to the file; not read back
  std::vector<ShadeTab> tabs;
};

/// Throws InputError.
ShadeSet ReadShades(const std::filesystem::path& file);
void WriteShades(const std::filesystem::path& file, const ShadeSet& set);

/// Reads a row per tab. A first line with words and without numbers is a heading: it names the columns `name`, `L*`,
/// `a*`, `b*`, and `stddev` or `sL`, `sa`, `sb`, in any order. Without one they are name, L*, a*, b* and no or three
/// standard deviations. Throws InputError.
std::vector<ShadeTab> ReadShadeTable(const std::filesystem::path& file);

/// Limits beyond any surface's colour, which catch a column in the wrong place, or a percentage.
bool IsSurfaceColour(const glm::dvec3& lab);

/// Three numbers separated by commas; otherwise absent.
std::optional<glm::dvec3> ThreeNumbers(const std::string& text);

}  // namespace crownfit
