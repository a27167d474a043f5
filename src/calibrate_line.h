#pragma once
// What `crownfit calibrate` and `crownfit capture init` were asked for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/boards.h"
#include "init_capture.h"

namespace crownfit {

struct CalibrateLine {
  std::string task;  ///< "camera", "colour", ...
  std::vector<std::filesystem::path> images;
  std::optional<std::filesystem::path> picture;
  Board board;
  std::string corners;  ///< COLUMNSxROWS
  std::vector<std::filesystem::path> darks;
  std::vector<double> times;  ///< of the exposures
  std::optional<std::filesystem::path> noise;
  std::vector<double> region;  ///< blur: x, y, width, height in pixels
  std::optional<double> dark_reflectance, light_reflectance;
  std::string chart = "colorchecker_classic_2014";  ///< colour
  std::vector<double> chart_corners;                ///< colour: x, y of four corners
  std::optional<std::filesystem::path> flat_field;  ///< colour: of a white card
  std::filesystem::path camera, jig, rig, card_poses;
  std::vector<std::string> lights, cards;  ///< NAME=FILE
  std::vector<double> balls;               ///< x, y, radius of each, in pixels
  double ball_mm = 0;
  std::optional<double> card_reflectance;  ///< lights: 0.9, grey cards: 0.18 where not said
  std::vector<double> grey_card;           ///< colour: x, y, width, height in pixels
  double lamp_mm = 0;                      ///< radius of the lamps; 0: seen under a degree
  int ball_count = 1;
  std::vector<double> card_mm;  ///< low x, low y, high x, high y of the part to read
  std::vector<std::filesystem::path> meshes;
  std::filesystem::path start;
  std::vector<double> placed;  ///< x, y, z in mm, a rotation vector in degrees: the object's frame in the start's
  bool together = false;
  double search_mm = 5, search_deg = 5;
  /// capture init: NAME=FILE, NAME=LIGHT,LIGHT and NAME=FILTER as they were written.
  std::vector<std::string> init_meshes, init_photographs, init_masks, init_lit, init_polarisation;
  CaptureParts parts;
  bool refine = false;
  bool is_linear = false;  ///< the files are proportional to the light, whatever they say of themselves
  bool is_series = false;  ///< noise: neighbours in the list are pairs
  double inside_mm = 16;   ///< target jig
  std::string target;      ///< chessboard, charuco, apriltag, jig
  std::string distortion;  ///< empty: as much as the corners tell
};

}  // namespace crownfit
