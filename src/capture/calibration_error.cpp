#include "capture/calibration_error.h"

#include <algorithm>
#include <cmath>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>

#include "base/linear_algebra.h"
#include "capture/capture.h"

namespace crownfit {
namespace {

bool SamePose(const RigidTransform& a, const RigidTransform& b) {
  return a.rotation == b.rotation && a.translation_mm == b.translation_mm;
}

/// Square roots of the covariance, largest first.
void AddPoseErrors(const Capture& capture, size_t photograph, std::vector<CalibrationError>& errors) {
  const PhotographSpec& spec = capture.photographs[photograph];
  CalibrationError error{"the pose of '" + spec.name + "'", {}, {}};
  for (size_t i = 0; i < capture.photographs.size(); ++i) {
    const PhotographSpec& other = capture.photographs[i];
    if (!other.pose_covariance || !SamePose(other.camera_from_object, spec.camera_from_object)) continue;
    if (i < photograph) return;  // counted with the first photograph of this pose
    error.photographs.push_back(i);
  }
  const auto [variances, directions] =
      EigenOfSymmetric(Eigen::Map<const Eigen::Matrix<double, 6, 6>>(spec.pose_covariance->data()));
  for (int k = 5; k >= 0; --k) {
    if (variances[k] <= 1e-14 * variances[5]) break;
    const Eigen::VectorXd v = std::sqrt(variances[k]) * directions.col(k);
    error.turn = {v[0], v[1], v[2]};
    error.shift = {v[3], v[4], v[5]};
    errors.push_back(error);
  }
}

void AddLightErrors(const Capture& capture, size_t index, std::vector<CalibrationError>& errors) {
  const Light& light = capture.lights[index];
  CalibrationError error{"the place of light '" + light.name + "'", {}, index};
  for (size_t i = 0; i < capture.photographs.size(); ++i)
    for (size_t l : capture.photographs[i].lights)
      if (l == index) error.photographs.push_back(i);
  const auto* far = std::get_if<DirectionalLight>(&light.shape);
  const double size = far ? light.stddev_deg * std::numbers::pi / 180 : light.Stddev_mm();
  if (size <= 0 || error.photographs.empty() || IsAllAround(light.shape)) return;
  if (far) {
    const glm::dvec3 any = std::abs(far->direction.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    const glm::dvec3 across = glm::normalize(glm::cross(far->direction, any));
    for (const glm::dvec3& axis : {across, glm::cross(far->direction, across)}) {
      error.shift = size * axis;
      errors.push_back(error);
    }
  } else {
    const auto [variances, directions] =
        EigenOfSymmetric(Eigen::Map<const Eigen::Matrix3d>(glm::value_ptr(light.covariance_mm2)));
    for (int k = 0; k < 3; ++k) {
      if (variances[k] <= 1e-14 * variances[2]) continue;
      const Eigen::VectorXd v = std::sqrt(variances[k]) * directions.col(k);
      error.shift = {v[0], v[1], v[2]};
      errors.push_back(error);
    }
  }
}

struct Shift {
  glm::dvec3 by;
  void operator()(DirectionalLight& l) const { l.direction = glm::normalize(l.direction + by); }
  void operator()(PointLight& l) const { l.position_mm += by; }
  void operator()(DiskLight& l) const { l.centre_mm += by; }
  void operator()(RectangleLight& l) const { l.centre_mm += by; }
  void operator()(DomeLight&) const {}
  void operator()(EnvironmentLight&) const {}
};

}  // namespace

std::vector<CalibrationError> StatedErrors(const Capture& capture) {
  std::vector<CalibrationError> errors;
  for (size_t i = 0; i < capture.photographs.size(); ++i)
    if (capture.photographs[i].pose_covariance) AddPoseErrors(capture, i, errors);
  for (size_t l = 0; l < capture.lights.size(); ++l) AddLightErrors(capture, l, errors);
  std::erase_if(errors, [&](const CalibrationError& e) {  // errors that the fit's photographs do not see
    return std::all_of(e.photographs.begin(), e.photographs.end(),
                       [&](size_t i) { return capture.photographs[i].is_holdout; });
  });
  return errors;
}

Capture Moved(const Capture& stated, const std::vector<CalibrationError>& errors, const std::vector<double>& amounts) {
  Capture moved = stated;
  std::vector<glm::dvec3> turns(stated.photographs.size(), glm::dvec3(0.0)), shifts = turns;
  for (size_t k = 0; k < errors.size(); ++k) {
    if (errors[k].light) {
      std::visit(Shift{amounts[k] * errors[k].shift}, moved.lights[*errors[k].light].shape);
      continue;
    }
    for (size_t i : errors[k].photographs) {
      turns[i] += amounts[k] * errors[k].turn;
      shifts[i] += amounts[k] * errors[k].shift;
    }
  }
  for (size_t i = 0; i < turns.size(); ++i) {
    RigidTransform& pose = moved.photographs[i].camera_from_object;
    pose = RigidTransform{RotationFromVector(turns[i]), shifts[i]} * pose;
  }
  return moved;
}

}  // namespace crownfit
