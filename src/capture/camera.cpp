#include "capture/camera.h"

#include <algorithm>
#include <cmath>

#include "base/json_file.h"

namespace crownfit {
namespace {

// Relative to the picture's longer side: a view of 179 degrees, or of 1 mm from 100 m. Pictures may be cropped
// off-centre.
constexpr double kShortest = 0.01, kLongest = 1e5, kFarthestCentre_px = 1e6;
constexpr double kOutOfSight = 1e6;  // tangent of an angle

glm::dvec2 Distorted(const std::array<double, 8>& d, const glm::dvec2& p) {
  const auto [k1, k2, p1, p2, k3, k4, k5, k6] = d;
  const double r2 = glm::dot(p, p);
  const double radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  return {p.x * radial + 2 * p1 * p.x * p.y + p2 * (r2 + 2 * p.x * p.x),
          p.y * radial + p1 * (r2 + 2 * p.y * p.y) + 2 * p2 * p.x * p.y};
}

}  // namespace

Camera ReadCamera(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat("crownfit-camera/1", {"width", "height", "fx", "fy", "cx", "cy",
                                                                  "distortion", "stddev", "quality", "provenance"});
  Camera camera;
  camera.width = root.Require("width").Integer(1, 20000);
  camera.height = root.Require("height").Integer(1, 20000);
  const auto focal = [&](const char* key) {
    const double side = std::max(camera.width, camera.height), f = root.Require(key).Positive();
    if (f < kShortest * side || f > kLongest * side)
      root.Require(key).Fail("this focal length is not plausible for a picture of " + std::to_string(camera.width) +
                                 " x " + std::to_string(camera.height) + " pixels",
                             "Give it in pixels: a lens with a field of view of 90 degrees has half the width.");
    return f;
  };
  camera.fx = focal("fx");
  camera.fy = focal("fy");
  camera.cx = root.Require("cx").Number(-kFarthestCentre_px, kFarthestCentre_px);
  camera.cy = root.Require("cy").Number(-kFarthestCentre_px, kFarthestCentre_px);
  if (const auto node = root.Find("distortion")) {
    const auto values = node->Numbers();
    if (values.size() != 0 && values.size() != 4 && values.size() != 5 && values.size() != 8)
      node->Fail("expected 0, 4, 5 or 8 numbers, found " + std::to_string(values.size()),
                 "OpenCV order: k1, k2, p1, p2, k3, k4, k5, k6.");
    std::copy(values.begin(), values.end(), camera.distortion.begin());
  }
  return camera;
}

Camera WithPixels(Camera camera, int width, int height, double across, double down) {
  camera.width = width;
  camera.height = height;
  camera.fx /= across;
  camera.cx /= across;
  camera.fy /= down;
  camera.cy /= down;
  return camera;
}

std::optional<glm::dvec2> PixelFromPoint(const Camera& camera, const glm::dvec3& p) {
  if (p.z <= 0) return std::nullopt;
  const glm::dvec2 d = Distorted(camera.distortion, {p.x / p.z, p.y / p.z});
  return glm::dvec2(camera.fx * d.x + camera.cx, camera.fy * d.y + camera.cy);
}

glm::dvec3 DirectionFromPixel(const Camera& camera, const glm::dvec2& pixel) {
  const glm::dvec2 wanted((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
  glm::dvec2 p = wanted;
  for (int step = 0; step < 20; ++step) {
    constexpr double kH = 1e-6;
    const glm::dvec2 here = Distorted(camera.distortion, p);
    const glm::dmat2 jacobian((Distorted(camera.distortion, p + glm::dvec2(kH, 0)) - here) / kH,
                              (Distorted(camera.distortion, p + glm::dvec2(0, kH)) - here) / kH);
    const glm::dvec2 change = glm::inverse(jacobian) * (wanted - here);
    if (!(glm::length(change) < kOutOfSight)) break;  // the distortion has no inverse here
    p += change;
    if (glm::length(change) < 1e-14) break;
  }
  return glm::normalize(glm::dvec3(p, 1.0));
}

}  // namespace crownfit
