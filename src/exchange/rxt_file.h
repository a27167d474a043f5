#pragma once
// Files of Prahl's inverse adding-doubling program iad (".rxt", its manual): total reflectance and transmittance of
// flat samples, measured in integrating spheres.

#include <filesystem>
#include <optional>
#include <vector>

namespace crownfit {

struct RxtRow {
  std::optional<double> wavelength_nm;
  std::optional<double> reflectance, transmittance;  ///< of a beam at normal incidence, specular reflection included
  double thickness_mm = 1, ior = 1.5;
  std::optional<double> asymmetry;
};

struct RxtFile {
  std::vector<RxtRow> rows;
  double slide_ior = 1, slide_thickness_mm = 0;  ///< index 1: none
};

/// Reads values that need no sphere correction. Throws InputError with line and column for text that is not a number,
/// rows of the wrong length, columns that are unknown or not modelled, and spheres that need a correction.
RxtFile ReadRxt(const std::filesystem::path& file);

}  // namespace crownfit
