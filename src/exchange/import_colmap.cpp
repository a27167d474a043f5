#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/gtc/quaternion.hpp>
#include <map>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "exchange/imported_views.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

/// COLMAP's camera models by their number (src/colmap/sensor/models.h); 0 parameters: not represented here.
struct Model {
  const char* name;
  size_t parameters;
};
constexpr Model kModels[] = {{"SIMPLE_PINHOLE", 3}, {"PINHOLE", 4},        {"SIMPLE_RADIAL", 4}, {"RADIAL", 5},
                             {"OPENCV", 8},         {"OPENCV_FISHEYE", 0}, {"FULL_OPENCV", 12},  {"FOV", 0}};
constexpr const char* kUndistort =
    "Undistort the photographs (`colmap image_undistorter`), or calibrate with OPENCV or FULL_OPENCV.";

/// COLMAP's pixels count as ours: the first one's centre is (0.5, 0.5).
Camera CameraOf(const Path& file, const std::string& model, uint64_t width, uint64_t height,
                const std::vector<double>& p) {
  const auto known = std::find_if(std::begin(kModels), std::end(kModels),
                                  [&](const Model& m) { return m.name == model && m.parameters > 0; });
  if (known == std::end(kModels))
    throw InputError(file, "", "camera model " + model + " has no equivalent here", kUndistort);
  if (p.size() != known->parameters)
    throw InputError(file, "",
                     "camera model " + model + " has " + std::to_string(known->parameters) + " parameters, found " +
                         std::to_string(p.size()));
  Camera camera;
  constexpr uint64_t kMost = 1 << 20;
  if (width < 1 || height < 1 || width > kMost || height > kMost)
    throw InputError(file, "", "a camera's size in pixels is not valid");
  camera.width = static_cast<int>(width);
  camera.height = static_cast<int>(height);
  const bool has_one_focal_length = model.starts_with("SIMPLE") || model == "RADIAL";
  camera.fx = p[0];
  camera.fy = has_one_focal_length ? p[0] : p[1];
  const size_t centre = has_one_focal_length ? 1 : 2;
  camera.cx = p[centre];
  camera.cy = p[centre + 1];
  std::copy(p.begin() + static_cast<std::ptrdiff_t>(centre) + 2, p.end(), camera.distortion.begin());
  if (!(camera.fx > 0 && camera.fy > 0)) throw InputError(file, "", "a camera's focal length is not positive");
  return camera;
}

RigidTransform PoseOf(const Path& file, const double (&q)[4], const glm::dvec3& translation) {
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(std::abs(length - 1.0) < 1e-3)) throw InputError(file, "", "an image's quaternion does not have length 1");
  const glm::dquat rotation(q[0] / length, q[1] / length, q[2] / length, q[3] / length);  // w first
  return {glm::mat3_cast(rotation), translation};
}

std::string ReadModel(const Path& file) {
  constexpr double kMostBytes = 1e9;  // points of ten thousand images
  return ReadWholeFile(file, kMostBytes, "Name a smaller model.");
}

/// A binary file, read from its begin to its end.
struct Bytes {
  explicit Bytes(const Path& path) : file(path), data(ReadModel(path)) {}
  template <class T>
  T Take() {
    Need(sizeof(T));
    char raw[sizeof(T)];
    std::memcpy(raw, data.data() + at, sizeof(T));
    at += sizeof(T);
    return std::bit_cast<T>(raw);
  }
  std::string Text() {
    const size_t end = data.find('\0', at);
    if (end == data.npos) Need(data.size());
    std::string text = data.substr(at, end - at);
    at = end + 1;
    return text;
  }
  void Skip(uint64_t count, uint64_t size) {
    if (count > data.size() / size) Need(data.size());
    Need(count * size);
    at += count * size;
  }
  void Need(size_t bytes) const {
    if (bytes > data.size() - at) throw InputError(file, "", "the file is truncated", "Write the model again.");
  }
  void RequireEnd() const {
    if (at != data.size()) throw InputError(file, "", "has bytes behind what it counts", "Write the model again.");
  }
  const Path& file;
  std::string data;
  size_t at = 0;
};

std::map<uint32_t, Camera> CamerasOfBinary(const Path& file) {
  std::map<uint32_t, Camera> cameras;
  Bytes bytes(file);
  for (auto left = bytes.Take<uint64_t>(); left > 0; --left) {
    const auto id = bytes.Take<uint32_t>();
    const auto model = bytes.Take<uint32_t>();
    const auto width = bytes.Take<uint64_t>(), height = bytes.Take<uint64_t>();
    if (model >= std::size(kModels) || kModels[model].parameters == 0)
      throw InputError(file, "",
                       "camera model " + (model < std::size(kModels) ? kModels[model].name : std::to_string(model)) +
                           " has no equivalent here",
                       kUndistort);
    std::vector<double> parameters(kModels[model].parameters);
    for (double& p : parameters) p = bytes.Take<double>();
    cameras[id] = CameraOf(file, kModels[model].name, width, height, parameters);
  }
  bytes.RequireEnd();
  return cameras;
}

struct PosedImage {
  std::string name;
  uint32_t camera;
  RigidTransform pose;
};

std::vector<PosedImage> ImagesOfBinary(const Path& file) {
  std::vector<PosedImage> images;
  Bytes bytes(file);
  for (auto left = bytes.Take<uint64_t>(); left > 0; --left) {
    bytes.Take<uint32_t>();  // its number
    double q[4];
    for (double& v : q) v = bytes.Take<double>();
    glm::dvec3 translation;
    for (int k = 0; k < 3; ++k) translation[k] = bytes.Take<double>();
    const auto camera = bytes.Take<uint32_t>();
    const std::string name = bytes.Text();
    images.push_back({name, camera, PoseOf(file, q, translation)});
    constexpr uint64_t kPoint = 2 * sizeof(double) + sizeof(uint64_t);
    bytes.Skip(bytes.Take<uint64_t>(), kPoint);
  }
  bytes.RequireEnd();
  return images;
}

/// The lines that are no comments. Of images.txt every second one lists points and may be empty.
std::vector<std::string> LinesOf(const Path& file) {
  std::vector<std::string> lines;
  std::istringstream text(ReadModel(file));
  for (std::string line; std::getline(text, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.starts_with("#")) lines.push_back(line);
  }
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  return lines;
}

std::map<uint32_t, Camera> CamerasOfText(const Path& file) {
  std::map<uint32_t, Camera> cameras;
  for (const std::string& line : LinesOf(file)) {
    std::istringstream words(line);
    uint32_t id = 0;
    std::string model;
    uint64_t width = 0, height = 0;
    if (!(words >> id >> model >> width >> height))
      throw InputError(file, "", "expected CAMERA_ID MODEL WIDTH HEIGHT PARAMS, found '" + line.substr(0, 80) + "'");
    std::vector<double> parameters;
    for (double p; words >> p;) parameters.push_back(p);
    cameras[id] = CameraOf(file, model, width, height, parameters);
  }
  return cameras;
}

std::vector<PosedImage> ImagesOfText(const Path& file) {
  std::vector<PosedImage> images;
  const std::vector<std::string> lines = LinesOf(file);
  for (size_t i = 0; i < lines.size(); i += 2) {
    std::istringstream words(lines[i]);
    uint32_t id = 0, camera = 0;
    double q[4];
    glm::dvec3 t;
    std::string name;
    if (!(words >> id >> q[0] >> q[1] >> q[2] >> q[3] >> t.x >> t.y >> t.z >> camera >> std::ws) ||
        !std::getline(words, name) || name.empty())
      throw InputError(file, "",
                       "expected IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, found '" + lines[i].substr(0, 80) + "'",
                       "Every image has two lines; the second lists its points and may be empty.");
    images.push_back({name, camera, PoseOf(file, q, t)});
  }
  return images;
}

}  // namespace

std::vector<ImportedView> ReadColmap(const Path& folder) {
  const auto exists = [&](const char* name) { return std::filesystem::is_regular_file(folder / name); };
  const bool is_binary = exists("cameras.bin") && exists("images.bin");
  if (!is_binary && !(exists("cameras.txt") && exists("images.txt")))
    throw InputError(folder, "", "holds no model of COLMAP (cameras.bin and images.bin, or cameras.txt and images.txt)",
                     "Name the folder of the sparse model, such as sparse/0.");
  const auto cameras = is_binary ? CamerasOfBinary(folder / "cameras.bin") : CamerasOfText(folder / "cameras.txt");
  const Path images = folder / (is_binary ? "images.bin" : "images.txt");
  std::vector<ImportedView> views;
  for (const PosedImage& image : is_binary ? ImagesOfBinary(images) : ImagesOfText(images)) {
    const auto camera = cameras.find(image.camera);
    if (camera == cameras.end())
      throw InputError(images, "",
                       "image '" + image.name + "' names camera " + std::to_string(image.camera) +
                           ", which the model does not have");
    views.push_back({image.name, camera->second, image.pose});
  }
  return views;
}

}  // namespace crownfit
