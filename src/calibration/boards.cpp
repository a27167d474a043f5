#include "calibration/boards.h"

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "calibration/opencv_aruco.h"
#include "calibration/opencv_image.h"

namespace crownfit {
namespace {

namespace aruco = cv::aruco;

glm::dvec2 OurPixel(const cv::Point2f& p) { return {p.x + 0.5, p.y + 0.5}; }

aruco::Dictionary DictionaryOf(const std::string& name) {
  static const std::map<std::string, int> known{{"4X4_50", aruco::DICT_4X4_50},
                                                {"4X4_100", aruco::DICT_4X4_100},
                                                {"4X4_250", aruco::DICT_4X4_250},
                                                {"4X4_1000", aruco::DICT_4X4_1000},
                                                {"5X5_50", aruco::DICT_5X5_50},
                                                {"5X5_100", aruco::DICT_5X5_100},
                                                {"5X5_250", aruco::DICT_5X5_250},
                                                {"5X5_1000", aruco::DICT_5X5_1000},
                                                {"6X6_50", aruco::DICT_6X6_50},
                                                {"6X6_100", aruco::DICT_6X6_100},
                                                {"6X6_250", aruco::DICT_6X6_250},
                                                {"6X6_1000", aruco::DICT_6X6_1000},
                                                {"7X7_50", aruco::DICT_7X7_50},
                                                {"7X7_100", aruco::DICT_7X7_100},
                                                {"7X7_250", aruco::DICT_7X7_250},
                                                {"7X7_1000", aruco::DICT_7X7_1000},
                                                {"ARUCO_ORIGINAL", aruco::DICT_ARUCO_ORIGINAL},
                                                {"APRILTAG_16h5", aruco::DICT_APRILTAG_16h5},
                                                {"APRILTAG_25h9", aruco::DICT_APRILTAG_25h9},
                                                {"APRILTAG_36h10", aruco::DICT_APRILTAG_36h10},
                                                {"APRILTAG_36h11", aruco::DICT_APRILTAG_36h11}};
  const auto found = known.find(name);
  if (found != known.end()) return PredefinedDictionary(found->second);
  std::string names;
  for (const auto& [known_name, value] : known) names += (names.empty() ? "" : ", ") + known_name;
  throw InputError("", "--dictionary", "there is no dictionary of markers called '" + name + "'",
                   "Known: " + names + ".");
}

/// Refines corners between four squares to sub-pixel accuracy. Nothing else may lie nearer to a corner than `clear_px`.
void Refine(const cv::Mat& grey, double clear_px, std::vector<cv::Point2f>& corners) {
  const int half = std::clamp(static_cast<int>(clear_px), 2, 11);
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1}, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-4});
}

/// Markers found on the picture enlarged `scale` times, with one of OpenCV's corner refinements.
FoundMarkers DetectEnlarged(const cv::Mat& grey, const std::string& name, float scale, int refinement) {
  cv::Mat large = grey;
  if (scale != 1.0f) cv::resize(grey, large, {}, scale, scale, cv::INTER_CUBIC);
  FoundMarkers found = DetectMarkers(large, DictionaryOf(name), refinement);
  // AprilTag's refinement counts pixels from their corners, and OpenCV does not convert.
  const float half = refinement == aruco::CORNER_REFINE_APRILTAG ? 0.0f : 0.5f;
  for (auto& marker : found.corners)
    for (auto& p : marker) p = (p + cv::Point2f(half, half)) / scale - cv::Point2f(0.5f, 0.5f);
  return found;
}

cv::Point2f CentreOf(const std::vector<cv::Point2f>& marker) {
  return 0.25f * (marker[0] + marker[1] + marker[2] + marker[3]);
}

/// AprilTag's own detector (Wang and Olson 2016) places corners to 0.03 px on an enlarged picture, the general one to
/// 0.12. But it misses some tags that the general one finds.
FoundMarkers DetectByName(const cv::Mat& grey, const std::string& name) {
  if (!name.starts_with("APRILTAG")) return DetectEnlarged(grey, name, 1.0f, aruco::CORNER_REFINE_SUBPIX);
  const float largest = 4000.0f / static_cast<float>(std::max(grey.cols, grey.rows));
  FoundMarkers found = DetectEnlarged(grey, name, std::clamp(largest, 1.0f, 2.0f), aruco::CORNER_REFINE_APRILTAG);
  const FoundMarkers more = DetectEnlarged(grey, name, std::clamp(largest, 1.0f, 3.0f), aruco::CORNER_REFINE_SUBPIX);
  for (size_t m = 0; m < more.ids.size(); ++m) {
    const auto is_same = [&](const std::vector<cv::Point2f>& marker) {
      return cv::norm(CentreOf(marker) - CentreOf(more.corners[m])) < 0.5 * cv::norm(marker[0] - marker[1]);
    };
    if (std::any_of(found.corners.begin(), found.corners.end(), is_same)) continue;
    found.corners.push_back(more.corners[m]);
    found.ids.push_back(more.ids[m]);
  }
  return found;
}

BoardView FindChessboard(const cv::Mat& grey, const Board& board) {
  std::vector<cv::Point2f> corners;
  const cv::Size size(board.columns, board.rows);
  const int flags = cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE;
  if (!cv::findChessboardCorners(grey, size, corners, flags)) return {};
  double nearest = 1e9;
  for (size_t i = 1; i < corners.size(); ++i)
    if (i % board.columns) nearest = std::min(nearest, cv::norm(corners[i] - corners[i - 1]));
  Refine(grey, 0.3 * nearest, corners);
  BoardView view;
  for (int i = 0; i < board.columns * board.rows; ++i) {
    const int column = i % board.columns, row = i / board.columns;
    view.board_mm.emplace_back(board.square_mm * column, board.square_mm * row, 0.0);
    view.pixel.push_back(OurPixel(corners[i]));
  }
  return view;
}

BoardView FindCharuco(const cv::Mat& grey, const Board& board) {
  const double marker_mm = CharucoMarker_mm(board);
  const FoundMarkers found = DetectByName(grey, DictionaryNameOf(board));
  BoardView view;
  if (found.ids.empty()) return view;
  auto [corners, ids] =
      CornersBetween(grey, found, {board.columns + 1, board.rows + 1}, static_cast<float>(board.square_mm),
                     static_cast<float>(marker_mm), DictionaryOf(DictionaryNameOf(board)));
  if (ids.empty()) return view;
  // OpenCV 4.6 returns refined corners half a pixel too far right and down. They are refined again from there.
  double marker_px = 1e9;
  for (const auto& marker : found.corners) marker_px = std::min(marker_px, cv::norm(marker[1] - marker[0]));
  Refine(grey, marker_px * 0.5 * (board.square_mm - marker_mm) / marker_mm, corners);
  for (size_t i = 0; i < ids.size(); ++i) {
    const int column = ids[i] % board.columns, row = ids[i] / board.columns;
    view.board_mm.emplace_back(board.square_mm * (column + 1), board.square_mm * (row + 1), 0.0);
    view.pixel.push_back(OurPixel(corners[i]));
  }
  return view;
}

BoardView FindTags(const cv::Mat& grey, const Board& board) {
  const FoundMarkers found = DetectByName(grey, DictionaryNameOf(board));
  const double step = TagStep_mm(board);
  BoardView view;
  for (size_t m = 0; m < found.ids.size(); ++m) {
    if (found.ids[m] >= board.columns * board.rows) continue;
    const int column = found.ids[m] % board.columns, row = found.ids[m] / board.columns;
    const glm::dvec3 origin(step * column, step * row, 0.0);
    const glm::dvec3 offsets[] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
    for (int k = 0; k < 4; ++k) {
      view.board_mm.push_back(origin + board.square_mm * offsets[k]);
      view.pixel.push_back(OurPixel(found.corners[m][k]));
    }
  }
  return view;
}

}  // namespace

std::string FaultOf(const Board& board) {
  if (board.columns < 2 || board.rows < 2) return "--corners: expected COLUMNSxROWS, each at least 2, such as 9x6";
  if (!(board.square_mm > 0)) return "--square-mm: give the width of a square in mm, as measured on the print";
  if (board.marker_mm >= board.square_mm) return "--marker-mm: a marker must be smaller than its square";
  if (board.kind == BoardKind::kChessboard && board.columns == board.rows)
    return "--corners: a chessboard with as many rows as columns looks the same after a quarter turn; use another "
           "board";
  return "";
}

std::string DictionaryNameOf(const Board& board) {
  if (!board.dictionary.empty()) return board.dictionary;
  return board.kind == BoardKind::kAprilTag ? "APRILTAG_36h11" : "4X4_250";
}

double CharucoMarker_mm(const Board& board) { return board.marker_mm > 0 ? board.marker_mm : 0.75 * board.square_mm; }

double TagStep_mm(const Board& board) {
  return board.square_mm + (board.gap_mm > 0 ? board.gap_mm : 0.3 * board.square_mm);
}

BoardView FindBoard(const ImageFile& photo, const Board& board) {
  switch (board.kind) {
    case BoardKind::kChessboard:
      return FindChessboard(StoredGrey8(photo), board);
    case BoardKind::kCharuco:
      return FindCharuco(StoredGrey8(photo), board);
    default:
      return FindTags(LinearGrey8(photo), board);
  }
}

std::vector<Marker> FindMarkers(const ImageFile& photo, const std::string& dictionary) {
  const FoundMarkers found = DetectByName(LinearGrey8(photo), dictionary);
  std::vector<Marker> markers;
  for (size_t m = 0; m < found.ids.size(); ++m) {
    markers.push_back({found.ids[m], {}});
    for (int k = 0; k < 4; ++k) markers.back().corner[k] = OurPixel(found.corners[m][k]);
  }
  return markers;
}

std::vector<std::vector<bool>> MarkerSquares(const std::string& dictionary, int id) {
  const aruco::Dictionary codes = DictionaryOf(dictionary);
  const int side = codes.markerSize + 2;
  if (id < 0 || id >= codes.bytesList.rows)
    throw InputError("", "--dictionary", dictionary + " has only " + std::to_string(codes.bytesList.rows) + " markers",
                     "Use a larger dictionary or a smaller board.");
  const cv::Mat drawn = DrawMarker(codes, id, side);
  std::vector<std::vector<bool>> squares(side, std::vector<bool>(side));
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) squares[y][x] = drawn.at<uchar>(y, x) < 128;
  return squares;
}

}  // namespace crownfit
