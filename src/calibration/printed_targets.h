#pragma once
// Targets to print: boards for the camera, jigs that hold markers around a crown, a slanted edge for sharpness.

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "base/json_file.h"
#include "calibration/boards.h"

namespace crownfit {

/// A filled polygon; grey is a share of the paper's reflectance.
struct Patch {
  std::vector<glm::dvec2> outline_mm;
  double grey;
};

struct PrintedText {
  glm::dvec2 at_mm;
  double size_mm;
  std::string text;
};

/// A print, x to the right and y down from its top left corner; later patches cover earlier ones.
struct PrintedTarget {
  glm::dvec2 size_mm{0.0};
  std::vector<Patch> patches;
  std::vector<PrintedText> texts;
  std::vector<std::vector<glm::dvec2>> cuts_mm;  ///< lines to cut along
};

/// Where a jig's markers are, in its own frame: x right, y down, z into the paper, origin at its middle.
struct Jig {
  std::string dictionary;
  std::vector<int> ids;
  std::vector<std::array<glm::dvec3, 4>> corners_mm;  ///< of each marker, clockwise from its top left as printed
};

/// A board with a white margin of one square; the board's origin lies at (square, square) of the print (chessboard: at
/// twice that, where its first inner corner is).
PrintedTarget PrintedBoard(const Board& board);

/// A frame of `inside_mm` by `inside_mm` (a hole, or paper to put the crown on) with markers around it, a scale bar, a
/// slanted edge, and places for grey patches.
struct JigLayout {
  double inside_mm = 16, marker_mm = 5;
  std::string dictionary = "4X4_50";
};
Jig JigOf(const JigLayout& layout);
PrintedTarget PrintedJig(const JigLayout& layout);

/// Marker positions as a file for `calibrate pose` ("crownfit-jig/1"), and back.
JsonValue JigJson(const Jig& jig);
Jig ReadJig(const std::filesystem::path& file);

/// SVG 1.1, in mm.
std::string SvgText(const PrintedTarget& target);

}  // namespace crownfit
