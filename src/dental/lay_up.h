#pragma once
// How options describe a material as a flat piece: its layers, measurement and comparison.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace crownfit {

struct LayUp {
  std::string thickness;  ///< "1.2", or "enamel=0.5,dentine=1"; empty: the material's own
  std::string stump, target = "white", black = "black", white = "white", cement = "clear";
  double stump_ior = 1.54;
  std::optional<double> cement_mm;
  std::string geometry = "45/0";
  std::optional<double> aperture_mm;
  std::optional<std::filesystem::path> colour, tabs;
  int draws = 400;
  uint64_t seed = 1;
  int threads = 0;
};

}  // namespace crownfit
