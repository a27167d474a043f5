#include "capture/poses.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <set>

#include "base/error.h"
#include "capture/covariance.h"

namespace crownfit {

glm::dmat3 PlaceCovariance(const std::array<double, 36>& covariance, const glm::dvec3& p) {
  // A rotation w and a shift t move the point by w x p + t: rows of 3 x 6.
  const double by[3][6] = {{0, p.z, -p.y, 1, 0, 0}, {-p.z, 0, p.x, 0, 1, 0}, {p.y, -p.x, 0, 0, 0, 1}};
  glm::dmat3 result(0.0);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) result[c][r] += by[r][i] * covariance[6 * i + j] * by[c][j];
  return result;
}

std::optional<std::array<double, 36>> ReadPoseCovariance(const JsonNode& transform) {
  const JsonObject o(transform, {"rotation", "translation_mm", "covariance", "stddev"});
  std::array<double, 36> result{};
  if (const auto covariance = o.Find("covariance")) {
    const std::vector<double> stated = ReadCovariance(*covariance, 6);
    std::copy(stated.begin(), stated.end(), result.begin());
    return result;
  }
  const auto stddev = o.Find("stddev");
  if (!stddev) return std::nullopt;
  const JsonObject of(*stddev, {"rotation_deg", "translation_mm"});
  const double turn = of.Require("rotation_deg").Number(0, 180) * std::numbers::pi / 180,
               shift = of.Require("translation_mm").Number(0, 1e4);
  // A rotation w about the origin's place t instead of about the camera shifts by -w x t.
  const glm::dvec3 t = ReadRigidTransform(transform).translation_mm;
  for (int axis = 0; axis < 6; ++axis) {
    std::array<double, 6> by{};
    by[axis] = axis < 3 ? turn : shift;
    const glm::dvec3 back = -glm::cross(glm::dvec3(by[0], by[1], by[2]), t);
    for (int k = 0; k < 3; ++k) by[3 + k] += back[k];
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) result[6 * r + c] += by[r] * by[c];
  }
  return result;
}

std::vector<StatedPose> ReadPoses(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat("crownfit-poses/1", {"poses", "quality", "provenance"});
  std::vector<StatedPose> poses;
  for (const JsonNode& node : root.Require("poses").Items()) {
    const JsonObject item(node, {"photograph", "camera_from_object"});
    StatedPose pose;
    pose.photograph = item.Require("photograph").String();
    const JsonNode transform = item.Require("camera_from_object");
    pose.camera_from_object = ReadRigidTransform(transform);
    pose.covariance = ReadPoseCovariance(transform);
    poses.push_back(pose);
  }
  if (poses.empty()) root.Require("poses").Fail("has no poses");
  std::set<std::string> names;
  for (const StatedPose& pose : poses)
    if (!names.insert(pose.photograph).second)
      root.Require("poses").Fail("has two poses of '" + pose.photograph + "'", "Keep one.");
  return poses;
}

JsonValue::Array PosesJson(const std::vector<StatedPose>& poses) {
  JsonValue::Array all;
  for (const StatedPose& pose : poses) {
    JsonValue::Object transform = RigidTransformJson(pose.camera_from_object);
    if (pose.covariance) {
      JsonValue::Array rows;
      for (int r = 0; r < 6; ++r)
        rows.emplace_back(std::vector<double>(pose.covariance->begin() + 6 * r, pose.covariance->begin() + 6 * r + 6));
      transform.emplace_back("covariance", rows);
    }
    all.emplace_back(JsonValue::Object{{"photograph", pose.photograph}, {"camera_from_object", transform}});
  }
  return all;
}

void RequireDistinctNames(const std::vector<std::filesystem::path>& photographs) {
  std::map<std::string, std::filesystem::path> seen;
  for (const auto& file : photographs)
    if (const auto [other, is_new] = seen.emplace(file.stem().string(), file); !is_new)
      throw InputError(file, "", "has the same name as " + other->second.string() + ", but poses are found by name",
                       "Give each photograph a file name of its own, and its pose that name.");
}

const StatedPose& PoseOf(const std::vector<StatedPose>& poses, const std::filesystem::path& photograph,
                         const std::filesystem::path& poses_file) {
  std::string known;
  for (const StatedPose& pose : poses) {
    if (pose.photograph == photograph.stem().string()) return pose;
    known += (known.empty() ? "" : ", ") + pose.photograph;
  }
  throw InputError(poses_file, "poses", "has no pose of " + photograph.stem().string(), "It has: " + known + ".");
}

}  // namespace crownfit
