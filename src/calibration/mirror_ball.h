#pragma once
// Where lamps are, from their highlights on polished balls.

#include <glm/glm.hpp>
#include <optional>
#include <vector>

#include "capture/camera.h"
#include "photo/image_io.h"

namespace crownfit {

/// A ball's outline in a photograph.
struct BallOutline {
  glm::dvec2 centre_px;
  double radius_px;
  double rms_px = 0;  ///< of edge points to the circle, when it was found
};

/// The `count` most distinct circles (OpenCV's Hough transform), each fitted to the edge points around it. `least_px`:
/// smallest radius.
std::vector<BallOutline> FindBalls(const ImageFile& photo, int count, double least_px = 20);

/// The lamp's image on a ball: the median position of pixels within 3 % of the brightest (a mean would follow other
/// reflections in the ball). Absent when no highlight is five times as bright as the ball's median.
struct Highlight2d {
  glm::dvec2 pixel;
  double stddev_px;  ///< a fifth of its radius, at least half a pixel
};
std::optional<Highlight2d> FindHighlight(const Image& linear, const BallOutline& ball);

/// A ray from a ball towards the lamp, in the camera frame.
struct LampRay {
  glm::dvec3 from_mm, direction;
  double stddev_rad;
};

/// With a camera: the ball of `radius_mm` is placed where its outline appears (a cone tangent to it). Without: parallel
/// projection along z, lengths in units of the ball's radius.
std::optional<LampRay> RayTowardsLamp(const BallOutline& ball, const Highlight2d& highlight, const Camera* camera,
                                      double radius_mm);

/// The point where rays from several balls meet (least squares of angles), with its covariance and the rms residual in
/// standard deviations. Absent when the rays are too parallel.
struct LampPosition {
  glm::dvec3 position_mm;
  glm::dmat3 covariance_mm2;
  double rms_sigma;
};
std::optional<LampPosition> Triangulate(const std::vector<LampRay>& rays);

}  // namespace crownfit
