#pragma once
// Focal length, principal point and distortion from photographs of a board (Zhang 2000, by OpenCV), with standard
// deviations that allow for errors which all corners of one photograph share.

#include <optional>
#include <string>
#include <vector>

#include "calibration/boards.h"
#include "calibration/product.h"
#include "capture/camera.h"
#include "capture/rigid_transform.h"

namespace crownfit {

/// How much of OpenCV's distortion is estimated.
enum class Distortion { kNone, kRadial1, kRadial2, kRadial2Tangential, kFull };

struct CameraView {
  std::string name;  ///< of the photograph
  BoardView corners;
};

struct CameraEstimate {
  Camera camera;
  Distortion distortion = Distortion::kNone;
  std::array<double, 9> stddev{};  ///< fx fy cx cy k1 k2 p1 p2 k3, pixels or no unit; 0 where not estimated
  double rms_px = 0;               ///< of the distances from corners to their predictions
  std::vector<size_t> used;        ///< views
  std::vector<RigidTransform> camera_from_board;  ///< of the used views
  std::vector<double> view_rms_px;  ///< of every view; of a rejected one under the camera fitted to the others
  double tilt_range_deg = 0;        ///< largest angle between two boards
};

/// Fits a camera of `width` x `height` pixels. If `distortion` is absent, uses the terms that differ from 0 by two
/// standard deviations. Leaves out a view whose rms is over three times the median of the others, and over half a
/// pixel. Absent when fewer than three views are left.
///
/// The standard deviations allow for errors that all corners of one photograph share (an uneven board, blur). OpenCV
/// treats every corner as an independent measurement and misses these. They come from the sandwich estimator over
/// photographs with the small-sample correction CR2 (Bell and McCaffrey 2002). They are never less than the classical
/// ones with 2 N - p - 6 V degrees of freedom.
std::optional<CameraEstimate> EstimateCamera(const std::vector<CameraView>& views, int width, int height,
                                             std::optional<Distortion> distortion = {});

/// Fraction of the cells of an 8 x 8 grid over the picture in which some used view has a corner.
double Coverage(const std::vector<CameraView>& views, const CameraEstimate& estimate);

/// The camera file with its figures, gates and picture. Throws InputError where there is nothing to fit.
Product CameraProduct(const std::vector<CameraView>& views, int width, int height,
                      std::optional<Distortion> distortion = {});

}  // namespace crownfit
