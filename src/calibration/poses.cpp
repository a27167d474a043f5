#include "calibration/poses.h"

#include "base/error.h"

namespace crownfit {

glm::dmat3 PlaceCovariance(const std::array<double, 36>& covariance, const glm::dvec3& p) {
  // A turn w and a shift t move the point by w x p + t: rows of 3 x 6.
  const double by[3][6] = {{0, p.z, -p.y, 1, 0, 0}, {-p.z, 0, p.x, 0, 1, 0}, {p.y, -p.x, 0, 0, 0, 1}};
  glm::dmat3 result(0.0);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) result[c][r] += by[r][i] * covariance[6 * i + j] * by[c][j];
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
    if (const auto covariance =
            JsonObject(transform, {"rotation", "translation_mm", "covariance", "stddev"}).Find("covariance")) {
      const auto rows = covariance->Items();
      if (rows.size() != 6) covariance->Fail("expected 6 rows of 6 numbers");
      pose.covariance.emplace();
      for (size_t r = 0; r < 6; ++r) {
        const auto row = rows[r].Numbers(6);
        std::copy(row.begin(), row.end(), pose.covariance->begin() + static_cast<std::ptrdiff_t>(6 * r));
      }
    }
    poses.push_back(pose);
  }
  if (poses.empty()) root.Require("poses").Fail("holds no poses");
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

const StatedPose& PoseOf(const std::vector<StatedPose>& poses, const std::filesystem::path& photograph,
                         const std::filesystem::path& poses_file) {
  std::string known;
  for (const StatedPose& pose : poses) {
    if (pose.photograph == photograph.stem().string()) return pose;
    known += (known.empty() ? "" : ", ") + pose.photograph;
  }
  throw InputError(poses_file, "poses", "holds no pose of " + photograph.stem().string(), "It has: " + known + ".");
}

}  // namespace crownfit
