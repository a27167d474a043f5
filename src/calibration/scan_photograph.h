#pragma once
// A photograph in which a scan is to be found.

#include <array>
#include <optional>

#include "capture/camera.h"
#include "capture/rigid_transform.h"
#include "photo/image.h"

namespace crownfit {

struct ScanPhotograph {
  const Image* linear;  ///< three channels
  Camera camera;
  RigidTransform start;                                         ///< camera_from_object, rough
  std::optional<std::array<double, 36>> start_covariance = {};  ///< as in StatedPose
};

}  // namespace crownfit
