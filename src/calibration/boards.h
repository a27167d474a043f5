#pragma once
// Flat targets whose corners are known: chessboards, ChArUco boards, grids of AprilTags. OpenCV finds them.
//
// Board frame: x to the right, y down as printed, z into the paper; the origin is the first inner corner (chessboard,
// ChArUco: the printed board's top left corner; AprilTag grid: the first tag's top left corner).
// Pixel positions are crownfit's: OpenCV's plus a half.

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "photo/image_io.h"

namespace crownfit {

enum class BoardKind { kChessboard, kCharuco, kAprilTag };

struct Board {
  BoardKind kind = BoardKind::kCharuco;
  int columns = 0, rows = 0;    ///< inner corners; of an AprilTag grid: tags
  double square_mm = 0;         ///< of a square; of an AprilTag grid: of a tag
  double marker_mm = 0;         ///< ChArUco: of a marker; 0: three quarters of a square
  double gap_mm = 0;            ///< AprilTag: between tags; 0: three tenths of a tag
  std::string dictionary = {};  ///< OpenCV's name without DICT_; empty: 4X4_250, or APRILTAG_36h11
};

/// Corners of one board found in one photograph.
struct BoardView {
  std::vector<glm::dvec3> board_mm;
  std::vector<glm::dvec2> pixel;
};

struct Marker {
  int id;
  glm::dvec2 corner[4];  ///< clockwise from its top left as printed
};

/// What is wrong with a description; empty when it is valid.
std::string FaultOf(const Board& board);

std::string DictionaryNameOf(const Board& board);  ///< its own, or the kind's usual one
double CharucoMarker_mm(const Board& board);
/// Column and row of the square that holds each marker of a ChArUco board: the white squares, row by row. The first
/// square is black as OpenCV prints boards since 4.6; before, it was white where the number of rows is even.
std::vector<glm::ivec2> CharucoMarkers(const Board& board, bool first_is_black);
double TagStep_mm(const Board& board);  ///< from one tag's corner to the next one's

/// Corners to sub-pixel accuracy; empty where the board is not found. A chessboard is found whole or not at all.
BoardView FindBoard(const ImageFile& photo, const Board& board);

/// Markers of a dictionary ("4X4_250", "APRILTAG_36h11", ...). Throws InputError for a name it does not know.
std::vector<Marker> FindMarkers(const ImageFile& photo, const std::string& dictionary);

/// A marker's squares, row by row with its black border: true is black.
std::vector<std::vector<bool>> MarkerSquares(const std::string& dictionary, int id);

}  // namespace crownfit
