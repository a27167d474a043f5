#pragma once
// Files of Prahl's inverse adding-doubling, iad (".rxt", its manual): total reflectance and transmittance of flat
// samples, measured in spheres.

#include <filesystem>
#include <optional>
#include <vector>

namespace crownfit {

struct RxtRow {
  std::optional<double> wavelength_nm;
  std::optional<double> reflectance, transmittance;  ///< of a beam along the normal, what is mirrored included
  double thickness_mm = 1, ior = 1.5;
  std::optional<double> asymmetry;
};

struct RxtFile {
  std::vector<RxtRow> rows;
  double slide_ior = 1, slide_thickness_mm = 0;  ///< index 1: none
};

/// Reads values that need no correction for a sphere. Throws InputError naming line and column: what is not a number, a
/// row that is too short or too long, columns that are not known or not modelled, spheres to correct for.
RxtFile ReadRxt(const std::filesystem::path& file);

}  // namespace crownfit
