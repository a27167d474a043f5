#pragma once
// Poses of photographs as input to a capture (`crownfit calibrate pose`).

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/rigid_transform.h"

namespace crownfit {

struct StatedPose {
  std::string photograph;  ///< file name without its extension
  RigidTransform camera_from_object;
  /// Of (rotation vector in radians, translation in mm), both applied in the camera frame after the pose; row by row.
  std::optional<std::array<double, 36>> covariance = {};
};

/// Covariance in mm^2 of a point of the object in the camera frame: x and y across the view, z along it.
glm::dmat3 PlaceCovariance(const std::array<double, 36>& pose_covariance, const glm::dvec3& point_in_camera_mm);

/// Covariance of a transform: its "covariance", or the equivalent of its "stddev" {"rotation_deg", "translation_mm"},
/// of a rotation about the object's origin and a shift, both along the camera's axes.
std::optional<std::array<double, 36>> ReadPoseCovariance(const JsonNode& transform);

/// poses.json ("crownfit-poses/1"): {"poses": [{"photograph", "camera_from_object": {"rotation", "translation_mm",
/// "covariance"}}]}.
std::vector<StatedPose> ReadPoses(const std::filesystem::path& file);
JsonValue::Array PosesJson(const std::vector<StatedPose>& poses);

/// Throws InputError where two photographs share a file name, by which poses are matched.
void RequireDistinctNames(const std::vector<std::filesystem::path>& photographs);

/// The pose of a photograph. Throws InputError naming the available ones.
const StatedPose& PoseOf(const std::vector<StatedPose>& poses, const std::filesystem::path& photograph,
                         const std::filesystem::path& poses_file);

}  // namespace crownfit
