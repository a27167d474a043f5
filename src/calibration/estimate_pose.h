#pragma once
// The pose of an object, from markers on a jig around it.

#include <optional>
#include <string>
#include <vector>

#include "calibration/boards.h"
#include "calibration/printed_targets.h"
#include "calibration/product.h"
#include "capture/camera.h"
#include "capture/poses.h"

namespace crownfit {

/// Corners of the jig's markers that a photograph shows.
BoardView FindJig(const ImageFile& photo, const Jig& jig);

struct MarkerPose {
  RigidTransform camera_from_board;
  std::array<double, 36> covariance;  ///< as in StatedPose
  double rms_px;
  size_t corners, left_out;  ///< left out: further off than 3 px and six times the median
};

/// The pose that predicts the corners best (OpenCV's SQPnP, then least squares). Absent with fewer than four corners.
/// The covariance assumes independent corner errors of the residuals' size, at least 0.05 px.
std::optional<MarkerPose> EstimatePose(const BoardView& view, const Camera& camera);

struct PosedPhotograph {
  std::string name;
  const Image* picture;
  BoardView view;
};

/// poses.json of photographs of a jig or board.
Product MarkerPosesProduct(const std::vector<PosedPhotograph>& photographs, const Camera& camera);

}  // namespace crownfit
