#pragma once
// What `crownfit calibrate` and `crownfit capture init` were asked for.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/boards.h"

namespace crownfit {

struct CalibrateLine {
  std::string task;  ///< "camera", "colour", ...
  std::vector<std::filesystem::path> images;
  std::optional<std::filesystem::path> picture;
  Board board;
  std::string corners;     ///< COLUMNSxROWS
  double inside_mm = 16;   ///< target jig
  std::string target;      ///< chessboard, charuco, apriltag, jig
  std::string distortion;  ///< empty: as much as the corners tell
};

}  // namespace crownfit
