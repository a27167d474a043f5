#include <cmath>

#include "base/error.h"
#include "base/json_file.h"
#include "exchange/imported_views.h"

namespace crownfit {
namespace {

using Members = std::vector<std::pair<std::string, JsonNode>>;

/// A key of the frame, or else of the file: cameras may be stated for all frames or for each.
class Keys {
 public:
  Keys(const Members& frame, const Members& file) : frame_(frame), file_(file) {}
  std::optional<JsonNode> Find(const std::string& key) const {
    for (const Members* members : {&frame_, &file_})
      for (const auto& [name, node] : *members)
        if (name == key) return node;
    return std::nullopt;
  }
  double NumberOr(const std::string& key, double otherwise) const {
    const auto node = Find(key);
    return node ? node->Number() : otherwise;
  }
  JsonNode Require(const std::string& key, const JsonNode& where, const std::string& remedy) const {
    const auto node = Find(key);
    if (!node) where.Fail("has no " + key, remedy);
    return *node;
  }

 private:
  const Members &frame_, &file_;
};

Camera CameraOf(const Keys& keys, const JsonNode& frame) {
  if (const auto model = keys.Find("camera_model"))
    if (const std::string name = model->String(); name != "OPENCV" && name != "PINHOLE" && name != "SIMPLE_PINHOLE")
      model->Fail("camera model " + name + " has no equivalent here", "Undistort the photographs.");
  if (const auto fisheye = keys.Find("is_fisheye"); fisheye && fisheye->Bool())
    fisheye->Fail("a fisheye camera has no equivalent here", "Undistort the photographs.");
  if (keys.NumberOr("k4", 0.0) != 0)
    keys.Find("k4")->Fail("the meaning of k4 differs between programs", "Undistort the photographs.");
  constexpr int kMost = 1 << 20;
  const std::string size = "Add w and h, the size of the photographs in pixels.";
  Camera camera;
  camera.width = static_cast<int>(keys.Require("w", frame, size).Number(1, kMost));
  camera.height = static_cast<int>(keys.Require("h", frame, size).Number(1, kMost));
  const auto focal = [&](const char* key, const char* angle_key, double pixels) {
    if (const auto node = keys.Find(key)) return node->Positive();
    const auto angle = keys.Find(angle_key);
    return angle ? 0.5 * pixels / std::tan(0.5 * angle->Number(1e-4, 3.1)) : 0.0;
  };
  camera.fx = focal("fl_x", "camera_angle_x", camera.width);
  camera.fy = focal("fl_y", "camera_angle_y", camera.height);
  if (camera.fx == 0)
    frame.Fail("has neither fl_x nor camera_angle_x", "State the focal length in pixels, or the angle.");
  if (camera.fy == 0) camera.fy = camera.fx;
  camera.cx = keys.NumberOr("cx", 0.5 * camera.width);
  camera.cy = keys.NumberOr("cy", 0.5 * camera.height);
  const char* const names[] = {"k1", "k2", "p1", "p2", "k3"};
  for (size_t k = 0; k < std::size(names); ++k) camera.distortion[k] = keys.NumberOr(names[k], 0.0);
  return camera;
}

/// OpenGL's camera looks along -z with y up; ours looks along z with y down.
RigidTransform CameraFromWorld(const JsonNode& matrix) {
  const auto rows = matrix.Items(4);
  if (rows.size() < 3) matrix.Fail("expected a matrix of 4 x 4");
  RigidTransform world_from_camera;
  for (int r = 0; r < 3; ++r) {
    const std::vector<double> row = rows[r].Numbers(4);
    for (int c = 0; c < 3; ++c) world_from_camera.rotation[c][r] = c == 0 ? row[c] : -row[c];
    world_from_camera.translation_mm[r] = row[3];
  }
  const auto rotation = RotationNear(world_from_camera.rotation);
  if (!rotation)
    matrix.Fail("is no rotation", "Scale the cameras' places, not their axes; crownfit has --mm-per-unit.");
  world_from_camera.rotation = *rotation;
  return world_from_camera.Inverse();
}

}  // namespace

std::optional<glm::dmat3> RotationNear(glm::dmat3 axes) {
  const glm::dmat3 product = glm::transpose(axes) * axes;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      if (!(std::abs(product[c][r] - (r == c)) < 1e-3)) return std::nullopt;
  if (!(glm::determinant(axes) > 0)) return std::nullopt;
  // What is left of rounding goes into no angle of a photograph.
  axes[0] = glm::normalize(axes[0]);
  axes[1] = glm::normalize(axes[1] - glm::dot(axes[0], axes[1]) * axes[0]);
  axes[2] = glm::cross(axes[0], axes[1]);
  return axes;
}

std::vector<ImportedView> ReadNerfTransforms(const std::filesystem::path& path) {
  const JsonFile file(path);
  const Members all = file.root().Members();
  const Members none;
  const auto frames = Keys(none, all).Find("frames");
  if (!frames) file.root().Fail("has no frames", "This is no transforms.json of a NeRF program.");
  std::vector<ImportedView> views;
  for (const JsonNode& frame : frames->Items()) {
    const Members members = frame.Members();
    const Keys keys(members, all);
    views.push_back({keys.Require("file_path", frame, "Name the photograph.").String(), CameraOf(keys, frame),
                     CameraFromWorld(keys.Require("transform_matrix", frame, "State the pose."))});
  }
  return views;
}

}  // namespace crownfit
