#include "calibration/boards.h"

#include <algorithm>
#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

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

/// A ChArUco board as printed, without its margin: `step_px` pixels for each square, black 0 and white 255.
cv::Mat CharucoPicture(const Board& board, const std::vector<glm::ivec2>& squares, int step_px) {
  constexpr int kFine = 4;  // pixels are means of so many by so many
  const int step = kFine * step_px;
  cv::Mat picture(step * (board.rows + 1), step * (board.columns + 1), CV_8U, cv::Scalar(0));
  const double marker = step * CharucoMarker_mm(board) / board.square_mm;
  const auto at = [](double x) { return static_cast<int>(std::lround(x)); };
  for (size_t id = 0; id < squares.size(); ++id) {
    const glm::dvec2 corner = static_cast<double>(step) * glm::dvec2(squares[id]);
    picture(cv::Rect(at(corner.x), at(corner.y), step, step)).setTo(255);
    const auto modules = MarkerSquares(DictionaryNameOf(board), static_cast<int>(id));
    const double module = marker / static_cast<double>(modules.size());
    const glm::dvec2 first = corner + 0.5 * (step - marker);
    for (size_t y = 0; y < modules.size(); ++y)
      for (size_t x = 0; x < modules.size(); ++x) {
        if (!modules[y][x]) continue;
        const glm::dvec2 place = first + module * glm::dvec2(x, y);
        const glm::ivec2 low(at(place.x), at(place.y)), high(at(place.x + module), at(place.y + module));
        picture(cv::Rect(low.x, low.y, high.x - low.x, high.y - low.y)).setTo(0);
      }
  }
  cv::resize(picture, picture, {}, 1.0 / kFine, 1.0 / kFine, cv::INTER_AREA);
  return picture;
}

/// The map from squares of the board to pixels that the markers around an inner corner give. Empty where none touches
/// it, where there is only one, and where they contradict each other.
cv::Mat MapFromMarkers(const Board& board, const FoundMarkers& found, const std::vector<glm::ivec2>& squares,
                       const glm::dvec2& corner) {
  const double half = 0.5 * CharucoMarker_mm(board) / board.square_mm, reach = 2.2;
  std::vector<cv::Point2d> on_board, in_picture;
  bool touches = false;
  for (size_t m = 0; m < found.ids.size(); ++m) {
    if (found.ids[m] >= static_cast<int>(squares.size())) continue;
    const glm::dvec2 centre = glm::dvec2(squares[found.ids[m]]) + 0.5;
    const double distance = glm::distance(centre, corner);
    if (distance > reach) continue;
    touches |= distance < 1.0;
    const glm::dvec2 clockwise[] = {{-half, -half}, {half, -half}, {half, half}, {-half, half}};
    for (int k = 0; k < 4; ++k) {
      on_board.emplace_back(centre.x + clockwise[k].x, centre.y + clockwise[k].y);
      in_picture.emplace_back(found.corners[m][k]);
    }
  }
  if (!touches || on_board.size() < 8) return {};
  const cv::Mat board_from_picture = cv::findHomography(in_picture, on_board);
  if (board_from_picture.empty()) return {};
  std::vector<cv::Point2d> mapped;
  cv::perspectiveTransform(in_picture, mapped, board_from_picture);
  constexpr double kLargestContradiction = 0.15;  // squares
  return cv::norm(mapped, on_board, cv::NORM_INF) < kLargestContradiction ? cv::Mat(board_from_picture.inv())
                                                                          : cv::Mat();
}

cv::Point2d Mapped(const cv::Mat& homography, const cv::Point2d& p) {
  std::vector<cv::Point2d> points{p};
  cv::perspectiveTransform(points, points, homography);
  return points[0];
}

/// Moves `map` (from squares of the board to pixels) until the print around a corner lies on the photograph: the
/// homography of largest correlation (Evangelidis and Psarakis 2008). Returns that correlation, 0 where there is none.
double AlignPrint(const cv::Mat& grey, const cv::Mat& print, int step_px, const glm::ivec2& corner, cv::Mat& map) {
  // Far enough for the markers beside the corner, whose edges hold what the corner alone does not.
  const int reach = static_cast<int>(0.9 * step_px);
  const cv::Point low = step_px * cv::Point(corner.x, corner.y) - cv::Point(reach, reach);
  const cv::Mat part = print(cv::Rect(low, cv::Size(2 * reach, 2 * reach)) & cv::Rect({}, print.size()));
  const double s = 1.0 / step_px;
  const cv::Mat squares_from_part =
      (cv::Mat_<double>(3, 3) << s, 0, s * (low.x + 0.5), 0, s, s * (low.y + 0.5), 0, 0, 1);
  const cv::Mat start = map * squares_from_part;
  // OpenCV filters all of the picture it is given.
  std::vector<cv::Point2d> outline{{0, 0}, {2.0 * reach, 0}, {2.0 * reach, 2.0 * reach}, {0, 2.0 * reach}};
  cv::perspectiveTransform(outline, outline, start);
  std::vector<cv::Point2f> around(outline.begin(), outline.end());
  cv::Rect region = cv::boundingRect(around);
  region -= cv::Point(8, 8);
  region += cv::Size(16, 16);
  region &= cv::Rect({}, grey.size());
  if (region.area() < reach * reach) return 0;
  cv::Mat shift = (cv::Mat_<double>(3, 3) << 1, 0, -region.x, 0, 1, -region.y, 0, 0, 1), warp;
  cv::Mat(shift * start).convertTo(warp, CV_32F);
  warp /= warp.at<float>(2, 2);
  try {
    const cv::TermCriteria until(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-5);
    const double correlation =
        cv::findTransformECC(part, grey(region), warp, cv::MOTION_HOMOGRAPHY, until, cv::noArray(), 1);
    cv::Mat found;
    warp.convertTo(found, CV_64F);
    map = shift.inv() * found * squares_from_part.inv();
    return correlation;
  } catch (const cv::Exception&) {
    return 0;  // it left the picture or did not converge
  }
}

/// Inner corners of a ChArUco board whose markers lie in these squares.
BoardView CornersOfCharuco(const cv::Mat& grey, const Board& board, const FoundMarkers& found,
                           const std::vector<glm::ivec2>& squares) {
  double marker_px = 1e9;
  for (const auto& marker : found.corners) marker_px = std::min(marker_px, cv::norm(marker[1] - marker[0]));
  const double square_px = marker_px * board.square_mm / CharucoMarker_mm(board);
  const int step_px = std::clamp(static_cast<int>(square_px), 12, 40);
  const cv::Mat print = CharucoPicture(board, squares, step_px);
  // A window with nothing but the corner holds it however the lens bends the squares, where the window is large enough.
  const double clear_px = 0.5 * (square_px - marker_px);
  const bool refine = clear_px >= 6.0;
  BoardView view;
  for (int row = 1; row <= board.rows; ++row)
    for (int column = 1; column <= board.columns; ++column) {
      cv::Mat map = MapFromMarkers(board, found, squares, glm::dvec2(column, row));
      if (map.empty()) continue;
      const cv::Point2d place(column, row), predicted = Mapped(map, place);
      constexpr double kLeastCorrelation = 0.7;
      if (AlignPrint(grey, print, step_px, {column, row}, map) < kLeastCorrelation) continue;
      std::vector<cv::Point2f> corner{Mapped(map, place)};
      if (cv::norm(cv::Point2d(corner[0]) - predicted) > 0.2 * square_px) continue;
      if (!cv::Rect({}, grey.size()).contains(corner[0])) continue;
      if (refine) Refine(grey, clear_px, corner);
      view.board_mm.emplace_back(board.square_mm * glm::dvec2(column, row), 0.0);
      view.pixel.push_back(OurPixel(corner[0]));
    }
  return view;
}

BoardView FindCharuco(const cv::Mat& grey, const Board& board) {
  const FoundMarkers found = DetectEnlarged(grey, DictionaryNameOf(board), 1.0f, aruco::CORNER_REFINE_NONE);
  if (found.ids.empty()) return {};
  BoardView black_first = CornersOfCharuco(grey, board, found, CharucoMarkers(board, true)),
            white_first = CornersOfCharuco(grey, board, found, CharucoMarkers(board, false));
  return black_first.pixel.size() >= white_first.pixel.size() ? black_first : white_first;
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

std::vector<glm::ivec2> CharucoMarkers(const Board& board, bool first_is_black) {
  std::vector<glm::ivec2> squares;
  for (int row = 0; row <= board.rows; ++row)
    for (int column = 0; column <= board.columns; ++column)
      if ((row % 2 == column % 2) != first_is_black) squares.emplace_back(column, row);
  return squares;
}

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
