#pragma once
// How a capture's calibration may be wrong by its own account.

#include <string>
#include <vector>

namespace crownfit {

struct Capture;

/// One way in which a place may be wrong, one standard deviation long; independent of the others.
struct CalibrationError {
  std::string what;                 ///< "the pose of 'front'"
  std::vector<size_t> photographs;  ///< that it changes
  std::optional<size_t> light;      ///< whose place moves; absent: the photographs' poses do
  glm::dvec3 turn{0.0};             ///< rad, in the camera frame after the pose
  glm::dvec3 shift{0.0};            ///< mm, of the pose or the light; of a light's direction: added to it
};

/// Of poses ("covariance", "stddev"; photographs of one pose share its error) and of lights ("stddev_mm",
/// "covariance", "stddev_deg"), where a photograph that is not held out feels them. Exposures and intensities are
/// factors and not among them.
std::vector<CalibrationError> StatedErrors(const Capture& capture);

/// The capture with its calibration moved by so many standard deviations of each.
Capture Moved(const Capture& stated, const std::vector<CalibrationError>& errors, const std::vector<double>& amounts);

}  // namespace crownfit
