#include "viewer/projection.h"

#include <algorithm>

namespace crownfit {

void SetCamera(Program& program, const PhotographSpec& photo, const std::pair<glm::dvec3, glm::dvec3>& bounds) {
  const auto& [low, high] = bounds;
  const RigidTransform& pose = photo.camera_from_object;
  const double distance = pose.Point(0.5 * (low + high)).z, reach = 0.5 * glm::distance(low, high);
  const Camera& c = photo.camera;
  program.Set("camera_rotation", glm::mat3(pose.rotation));
  program.Set("camera_translation", glm::vec3(pose.translation_mm));
  program.Set("focal_centre_x", glm::vec3(c.fx, c.cx, c.width));
  program.Set("focal_centre_y", glm::vec3(c.fy, c.cy, c.height));
  program.Set("distortion", std::span<const float>(std::vector<float>(c.distortion.begin(), c.distortion.end())));
  program.Set("depth_range", glm::vec2(std::max(0.1, distance - 1.5 * reach), distance + 1.5 * reach));
}

}  // namespace crownfit
