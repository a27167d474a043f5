#pragma once
// Photographs of printed targets, computed: perspective, distortion, blur and noise.

#include "calibration/printed_targets.h"
#include "capture/camera.h"
#include "capture/rigid_transform.h"
#include "photo/image.h"

namespace crownfit {

struct RenderedLight {
  double level = 1.0;     ///< pixel of a white tile
  double surround = 0.3;  ///< reflectance of what lies around the print
  double sigma_px = 0.6;  ///< Gaussian blur
  double wide_sigma_px = 3.0, wide_weight = 0.0;
  double veiling_glare = 0.0;  ///< share of all light spread evenly
  double gain = 2e-5, read_noise = 1e-3;
  uint64_t seed = 1;
};

/// Paper reflects 0.9, ink 0.04. One grey channel, linear, averaged over each pixel. `target_origin_mm`: the point of
/// the print where the frame of `camera_from_board` has its origin.
Image RenderTarget(const PrintedTarget& target, const glm::dvec2& target_origin_mm, const Camera& camera,
                   const RigidTransform& camera_from_board, const RenderedLight& light);

/// Convolved with a Gaussian, edges repeated.
Image Blurred(const Image& image, double sigma_px);

/// With variance gain x value + read_noise^2.
Image Noisy(const Image& image, double gain, double read_noise, uint64_t seed);

/// Looks at `aim_mm` of a board from `distance_mm`, tilted by `tilt_deg` towards `azimuth_deg`, turned by `roll_deg`.
RigidTransform LookingAt(const glm::dvec3& aim_mm, double distance_mm, double tilt_deg, double azimuth_deg,
                         double roll_deg);

}  // namespace crownfit
