#pragma once
// Errors of a capture's calibration, as the capture states them.

#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

struct Capture;

/// One possible error of a position, one standard deviation long; independent of the others.
struct CalibrationError {
  std::string what;                 ///< "the pose of 'front'"
  std::vector<size_t> photographs;  ///< that it affects
  std::optional<size_t> light;      ///< the light that moves; absent: the photographs' poses move
  glm::dvec3 turn{0.0};             ///< rad, in the camera frame after the pose
  glm::dvec3 shift{0.0};            ///< mm, of the pose or the light; for a light's direction: added to it
};

/// Errors of poses ("covariance", "stddev"; photographs of one pose share its error) and of lights ("stddev_mm",
/// "covariance", "stddev_deg") that affect a photograph that is not held out. Exposures and intensities are factors and
/// not included.
std::vector<CalibrationError> StatedErrors(const Capture& capture);

/// The capture with its calibration displaced by `amounts` standard deviations of each error.
Capture Moved(const Capture& stated, const std::vector<CalibrationError>& errors, const std::vector<double>& amounts);

}  // namespace crownfit
