#include "exchange/opencv_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <pugixml.hpp>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "base/limits.h"
#include "base/text.h"

// cv::FileStorage itself crashes on damaged files (4.6), so the few forms that its writers make are read here.

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Names = std::initializer_list<const char*>;

constexpr int kMostPixels = 20000;
constexpr size_t kMostViews = 10000;

/// What stands behind a key, as text.
struct Entry {
  bool is_matrix = false;
  std::string rows, columns;
  std::string text;  ///< of a matrix its data, of a list its items
};
using Entries = std::map<std::string, Entry>;

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r\n"), last = text.find_last_not_of(" \t\r\n");
  return first == text.npos ? "" : text.substr(first, last - first + 1);
}

/// Items between blanks, commas and brackets; quoted ones whole. A dash before an item is YAML's mark of a list.
std::vector<std::string> ItemsOf(const std::string& text) {
  constexpr const char* kBetween = " \t\r\n,[]";
  std::vector<std::string> items;
  for (size_t at = 0; (at = text.find_first_not_of(kBetween, at)) != text.npos;) {
    const char quote = text[at];
    const bool is_quoted = quote == '"' || quote == '\'';
    const size_t end = std::min(is_quoted ? text.find(quote, at + 1) : text.find_first_of(kBetween, at), text.size());
    const std::string item = is_quoted ? text.substr(at + 1, end - at - 1) : text.substr(at, end - at);
    if (is_quoted || item != "-") items.push_back(item);
    at = std::min(end + (is_quoted ? 1 : 0), text.size());
  }
  return items;
}

/// The value of a key within a block of YAML, up to its line's or its list's end.
std::string ValueIn(const std::string& block, const std::string& key) {
  size_t at = block.find(key + ":");
  if (at == block.npos) return "";
  at = std::min(block.find_first_not_of(" \t", at + key.size() + 1), block.size());
  const size_t end = at < block.size() && block[at] == '[' ? block.find(']', at) : block.find('\n', at);
  return block.substr(at, end == block.npos ? end : end - at);
}

Entries ReadYaml(const std::string& text) {
  std::vector<std::pair<std::string, std::string>> blocks;  // by keys at the begin of a line
  std::istringstream lines(text);
  bool is_in_list = false;
  for (std::string line; std::getline(lines, line);) {
    const std::string trimmed = Trimmed(line);
    if (trimmed.empty() || trimmed[0] == '#' || trimmed[0] == '%' || trimmed == "---" || trimmed == "...") continue;
    const size_t colon = line.find(':');
    if (!is_in_list && line[0] != ' ' && line[0] != '\t' && line[0] != '-' && colon != line.npos)
      blocks.emplace_back(Trimmed(line.substr(0, colon)), line.substr(colon + 1) + "\n");
    else if (!blocks.empty())
      blocks.back().second += line + "\n";
    if (const size_t open = line.rfind('['); open != line.npos)
      is_in_list = line.find(']', open) == line.npos;
    else if (line.find(']') != line.npos)
      is_in_list = false;
  }
  Entries entries;
  for (const auto& [key, block] : blocks) {
    Entry entry{block.find("!!opencv-matrix") != block.npos, {}, {}, block};
    if (entry.is_matrix)
      entry = {true, Trimmed(ValueIn(block, "rows")), Trimmed(ValueIn(block, "cols")), ValueIn(block, "data")};
    entries[key] = entry;
  }
  return entries;
}

Entries ReadXml(const Path& path, const std::string& text) {
  pugi::xml_document document;
  const auto parsed = document.load_buffer(text.data(), text.size());
  if (!parsed) throw InputError(path, "", std::string("is no XML: ") + parsed.description());
  Entries entries;
  for (const pugi::xml_node& node : document.document_element().children()) {
    const bool is_matrix = std::string(node.attribute("type_id").value()) == "opencv-matrix";
    entries[node.name()] = {is_matrix, Trimmed(node.child("rows").child_value()),
                            Trimmed(node.child("cols").child_value()),
                            is_matrix ? node.child("data").child_value() : node.child_value()};
  }
  return entries;
}

/// A file, and its entry by the first of several names: OpenCV's programs have written more than one.
struct Reader {
  const Path& path;
  Entries entries;

  const std::pair<const std::string, Entry>* Find(Names names) const {
    for (const char* name : names)
      if (const auto found = entries.find(name); found != entries.end()) return &*found;
    return nullptr;
  }

  double Number(const std::string& key, const std::string& text) const {
    const std::string word = Trimmed(text);
    const char *first = word.data() + word.starts_with('+'), *last = word.data() + word.size();
    double value = 0;
    const auto [stop, error] = std::from_chars(first, last, value);
    if (error != std::errc() || stop != last || !std::isfinite(value))
      throw InputError(path, key, "expected a number, found '" + word.substr(0, 40) + "'");
    return value;
  }
};

struct Matrix {
  std::string key;
  size_t rows = 0, columns = 0;
  std::vector<double> values;  ///< row by row
};

std::optional<Matrix> MatrixOf(const Reader& file, Names names, size_t most_rows, size_t most_columns) {
  const auto* found = file.Find(names);
  if (!found) return std::nullopt;
  const auto& [key, entry] = *found;
  const std::string expected =
      "expected a matrix of up to " + std::to_string(most_rows) + " x " + std::to_string(most_columns) + " numbers";
  if (!entry.is_matrix) throw InputError(file.path, key, expected);
  const double rows = file.Number(key + ".rows", entry.rows), columns = file.Number(key + ".cols", entry.columns);
  if (!(rows >= 1 && rows <= static_cast<double>(most_rows) && columns >= 1 &&
        columns <= static_cast<double>(most_columns)))
    throw InputError(file.path, key, expected);
  Matrix matrix{key, static_cast<size_t>(rows), static_cast<size_t>(columns), {}};
  for (const std::string& item : ItemsOf(entry.text)) matrix.values.push_back(file.Number(key + ".data", item));
  if (matrix.values.size() != matrix.rows * matrix.columns)
    throw InputError(file.path, key + ".data", "does not have rows x cols numbers");
  return matrix;
}

std::array<double, 8> DistortionOf(const Reader& file) {
  std::array<double, 8> distortion{};
  if (const auto* fisheye = file.Find({"fisheye_model"}); fisheye && Trimmed(fisheye->second.text) != "0")
    throw InputError(file.path, fisheye->first, "a fisheye camera has no equivalent here",
                     "Undistort the photographs.");
  const auto matrix = MatrixOf(file, {"distortion_coefficients", "Distortion_Coefficients", "distCoeffs"}, 14, 14);
  if (!matrix) return distortion;
  const size_t count = matrix->values.size();
  if (count != 4 && count != 5 && count != 8 && count != 12 && count != 14)
    throw InputError(file.path, matrix->key, "expected 4, 5 or 8 coefficients, found " + std::to_string(count),
                     "OpenCV order: k1, k2, p1, p2, k3, k4, k5, k6.");
  for (size_t k = 0; k < count; ++k)
    if (k < distortion.size())
      distortion[k] = matrix->values[k];
    else if (matrix->values[k] != 0)
      throw InputError(file.path, matrix->key,
                       "coefficients of a thin prism or a tilted sensor have no equivalent here",
                       "Calibrate without CALIB_THIN_PRISM_MODEL and CALIB_TILTED_MODEL.");
  return distortion;
}

int SizeOf(const Reader& file, Names names) {
  const auto* found = file.Find(names);
  if (!found)
    throw InputError(file.path, *names.begin(), "this key is missing",
                     "Add image_width and image_height, the size in pixels of the photographs.");
  const double size = file.Number(found->first, found->second.text);
  if (!(size >= 1 && size <= kMostPixels && size == std::floor(size)))
    throw InputError(file.path, found->first, "is no size of a picture in pixels");
  return static_cast<int>(size);
}

/// OpenCV's pixels have their centres at whole numbers, ours at halves.
Camera CameraOf(const Reader& file) {
  const auto matrix = MatrixOf(file, {"camera_matrix", "Camera_Matrix", "cameraMatrix"}, 3, 3);
  if (!matrix)
    throw InputError(file.path, "camera_matrix", "this key is missing",
                     "Write the calibration by OpenCV's program camera_calibration, or use camera.json.");
  if (matrix->values.size() != 9) throw InputError(file.path, matrix->key, "expected 3 x 3 numbers");
  const std::vector<double>& m = matrix->values;
  Camera camera;
  camera.width = SizeOf(file, {"image_width", "image_Width"});
  camera.height = SizeOf(file, {"image_height", "image_Height"});
  camera.fx = m[0], camera.fy = m[4];
  camera.cx = m[2] + 0.5, camera.cy = m[5] + 0.5;
  constexpr double kShortest = 0.01, kLongest = 1e5, kFarthestCentre_px = 1e6;  // as in camera.json
  const double side = std::max(camera.width, camera.height);
  for (const double focal : {camera.fx, camera.fy})
    if (!(focal >= kShortest * side && focal <= kLongest * side))
      throw InputError(file.path, matrix->key, "its focal length is not plausible for the picture's size",
                       "Give it in pixels of the photographs that image_width and image_height state.");
  if (!(std::abs(camera.cx) < kFarthestCentre_px && std::abs(camera.cy) < kFarthestCentre_px))
    throw InputError(file.path, matrix->key, "its principal point is not plausible");
  if (m[1] != 0) throw InputError(file.path, matrix->key, "its axes are skew, which has no equivalent here");
  camera.distortion = DistortionOf(file);
  if (const auto radius = FoldRadius_px(camera))
    throw InputError(file.path, "distortion_coefficients",
                     "the distortion folds back " + Number(*radius) +
                         " px from the principal point, inside the picture: it is not one-to-one",
                     "Calibrate with fewer coefficients.");
  return camera;
}

/// Rows of a rotation vector and a translation.
std::vector<RigidTransform> PosesOf(const Reader& file) {
  std::vector<RigidTransform> poses;
  const auto matrix = MatrixOf(file, {"extrinsic_parameters", "Extrinsic_Parameters"}, kMostViews, 6);
  if (!matrix) return poses;
  if (matrix->columns != 6)
    throw InputError(file.path, matrix->key, "expected 6 columns: a rotation vector and a translation");
  for (size_t row = 0; row < matrix->rows; ++row) {
    const double* v = matrix->values.data() + 6 * row;
    if (!(glm::length(glm::dvec3(v[0], v[1], v[2])) < 100))
      throw InputError(file.path, matrix->key, "a rotation vector is not plausible", "It is in radians.");
    poses.push_back({RotationFromVector({v[0], v[1], v[2]}), {v[3], v[4], v[5]}});
  }
  return poses;
}

std::vector<std::string> PhotographsOf(const Reader& file, size_t views) {
  const auto* found = file.Find({"image_names", "image_list", "imagelist", "images"});
  if (!found) return {};
  const std::vector<std::string> names = ItemsOf(found->second.text);
  if (names.size() != views)
    throw InputError(file.path, found->first, "expected as many names as extrinsic_parameters has rows");
  return names;
}

}  // namespace

bool IsOpenCvFile(const Path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;
  std::ifstream in(path, std::ios::binary);
  std::string begin(256, '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<size_t>(in.gcount()));
  return begin.starts_with("%YAML") || begin.find("<opencv_storage>") != begin.npos;
}

OpenCvCalibration ReadOpenCvCalibration(const Path& path) {
  const std::string text = ReadWholeFile(path, InputLimits().json_MiB * (1 << 20), "Name a file of a calibration.");
  const bool is_xml = Trimmed(text.substr(0, 256)).starts_with('<');
  const Reader file{path, is_xml ? ReadXml(path, text) : ReadYaml(text)};
  OpenCvCalibration calibration{CameraOf(file), PosesOf(file), {}};
  calibration.photographs = PhotographsOf(file, calibration.camera_from_board.size());
  return calibration;
}

Camera ReadCameraOrOpenCv(const Path& path) {
  return IsOpenCvFile(path) ? ReadOpenCvCalibration(path).camera : ReadCamera(path);
}

}  // namespace crownfit
