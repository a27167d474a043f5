#pragma once
// What `crownfit predict` and `crownfit shades` were asked for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

struct PredictLine {
  bool is_asked = false;  ///< `report`: any of these was given
  std::string thickness;  ///< "1.2", or "enamel=0.5,dentine=1"; empty: the material's own
  std::string stump, target = "white", black = "black", white = "white", cement = "clear";
  double stump_ior = 1.54;
  std::optional<double> cement_mm;
  std::string geometry = "45/0";
  std::optional<double> aperture_mm;
  std::optional<std::filesystem::path> colour, tabs;
  int draws = 400;
};

struct ShadesLine {
  std::string task;  ///< "measured", "photographed", "nearest"
  std::filesystem::path input;
  std::string note;
  std::vector<std::string> patches;  ///< NAME=X,Y,WIDTH,HEIGHT
  std::vector<double> card;          ///< x, y, width, height of a white or grey card
  std::optional<double> card_reflectance;
  std::string sample;  ///< nearest: material.json, or L,a,b
  std::string stddev;  ///< nearest: of L,a,b
};

}  // namespace crownfit
