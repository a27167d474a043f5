#pragma once
// Pinhole camera with OpenCV's distortion. Camera frame: x right, y down, z forward. Pixel (0,0) has its centre at
// (0.5, 0.5).

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>

#include "base/json_file.h"

namespace crownfit {

struct Camera {
  int width = 0, height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  std::array<double, 8> distortion{};     ///< k1 k2 p1 p2 k3 k4 k5 k6 (OpenCV order)
  bool operator==(const Camera&) const = default;
};

/// Reads camera.json ("crownfit-camera/1").
Camera ReadCamera(const std::filesystem::path& file);

/// The same as JSON.
JsonValue::Object CameraJson(const Camera& camera);

/// The same view in `width` x `height` pixels, each `across` x `down` old pixels in size, from the same corner.
Camera WithPixels(Camera camera, int width, int height, double across, double down);

/// Pixel position of a point in the camera frame; nothing when it is not in front of the camera.
std::optional<glm::dvec2> PixelFromPoint(const Camera& camera, const glm::dvec3& point_in_camera_mm);

/// Distance from the principal point, in pixels, at which the distortion folds back (or has a pole) inside the picture:
/// beyond it pixels belong to no direction, or to two. Nothing where it is one-to-one over the picture.
std::optional<double> FoldRadius_px(const Camera& camera);

/// Unit direction in the camera frame through a pixel position (inverts the distortion by Newton steps).
glm::dvec3 DirectionFromPixel(const Camera& camera, const glm::dvec2& pixel);

}  // namespace crownfit
