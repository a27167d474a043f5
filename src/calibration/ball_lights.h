#pragma once
// Positions of lamps from photographs of mirror balls.

#include <string>
#include <vector>

#include "calibration/mirror_ball.h"
#include "capture/light_rig.h"

namespace crownfit {

/// One photograph of mirror balls under one lamp.
struct BallPhotograph {
  std::string light;
  const Image* linear;
  std::vector<BallOutline> balls;
};

/// Directions; or positions, where two balls show the lamp from different sides and its distance is known to 30 %. In
/// the camera frame, irradiance 1 at the balls. Notes name what could not be found.
std::vector<Light> LightsFromBalls(const std::vector<BallPhotograph>& photographs, const Camera* camera,
                                   double radius_mm, std::vector<std::string>& notes);

/// The photographs with their balls outlined and the reflections taken for the lamp.
Image BallsPicture(const std::vector<BallPhotograph>& photographs);

}  // namespace crownfit
