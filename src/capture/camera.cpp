#include "capture/camera.h"

#include <algorithm>
#include <cmath>

#include "base/json_file.h"
#include "base/text.h"

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
    if (const auto radius = FoldRadius_px(camera))
      node->Fail("the distortion folds back " + Number(*radius) +
                     " px from the principal point, inside the picture: it is not one-to-one",
                 "Calibrate with photographs whose boards reach the picture's corners, or with fewer coefficients.");
  }
  return camera;
}

JsonValue::Object CameraJson(const Camera& c) {
  return {{"format", "crownfit-camera/1"},
          {"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"distortion", std::vector<double>(c.distortion.begin(), c.distortion.end())}};
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

std::optional<double> FoldRadius_px(const Camera& camera) {
  constexpr int kBorder = 64, kSteps = 512, kMostSteps = 100 * kSteps;
  const glm::dvec2 centre(camera.cx, camera.cy), focal(camera.fx, camera.fy), size(camera.width, camera.height);
  const auto determinant = [&](const glm::dvec2& p) {
    const double h = 1e-6 * std::max(1e-3, glm::length(p));
    const glm::dvec2 along_x = Distorted(camera.distortion, p + glm::dvec2(h, 0)) -
                               Distorted(camera.distortion, p - glm::dvec2(h, 0)),
                     along_y = Distorted(camera.distortion, p + glm::dvec2(0, h)) -
                               Distorted(camera.distortion, p - glm::dvec2(0, h));
    return (along_x.x * along_y.y - along_x.y * along_y.x) / (4 * h * h);
  };
  const auto denominator = [&d = camera.distortion](double r2) { return 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7])); };
  std::optional<double> nearest;
  for (int b = 0; b < kBorder; ++b) {
    // Outwards until the border is reached, on which the picture ends.
    const int side = b % 4, of_side = b / 4;
    constexpr double kOnSide = kBorder / 4.0;
    const double along = (of_side + 0.5) / kOnSide;
    const glm::dvec2 corner_to_corner = side == 0   ? glm::dvec2(along, 0)
                                        : side == 1 ? glm::dvec2(along, 1)
                                        : side == 2 ? glm::dvec2(0, along)
                                                    : glm::dvec2(1, along);
    const glm::dvec2 border = (corner_to_corner * size - centre) / focal;
    const double reach = glm::length(border);
    if (!(reach > 0)) continue;
    const glm::dvec2 direction = border / reach;
    for (int step = 1; step <= kMostSteps; ++step) {
      const double r = reach * step / kSteps;
      const glm::dvec2 at = Distorted(camera.distortion, r * direction);
      const bool has_turned = !(denominator(r * r) > 0) || !(determinant(r * direction) > 0);
      if (has_turned || step == kMostSteps) {
        const double radius = glm::length(glm::min(glm::abs(at), glm::dvec2(reach)) * focal);
        nearest = std::min(nearest.value_or(radius), radius);
        break;
      }
      if (glm::dot(at, direction) >= reach) break;
    }
  }
  return nearest;
}

std::optional<glm::dvec2> PixelFromPoint(const Camera& camera, const glm::dvec3& p) {
  if (p.z <= 0) return std::nullopt;
  const glm::dvec2 d = Distorted(camera.distortion, {p.x / p.z, p.y / p.z});
  return glm::dvec2(camera.fx * d.x + camera.cx, camera.fy * d.y + camera.cy);
}

namespace {

/// The point whose distortion is `wanted`, by Newton steps from `p`; nothing where they do not converge to one on the
/// branch that begins at the axis.
std::optional<glm::dvec2> Undistorted(const std::array<double, 8>& d, const glm::dvec2& wanted, glm::dvec2 p) {
  constexpr double kConverged = 1e-9;  // of the tangent: a thousandth of a pixel in any picture
  for (int step = 0; step < 20; ++step) {
    constexpr double kH = 1e-6;
    const glm::dvec2 here = Distorted(d, p);
    const glm::dmat2 jacobian((Distorted(d, p + glm::dvec2(kH, 0)) - here) / kH,
                              (Distorted(d, p + glm::dvec2(0, kH)) - here) / kH);
    const glm::dvec2 change = glm::inverse(jacobian) * (wanted - here);
    if (!(glm::length(change) < kOutOfSight)) return std::nullopt;
    p += change;
    if (glm::length(change) < 1e-14) break;
  }
  const double r2 = glm::dot(p, p);
  const bool is_before_pole = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7])) > 0;
  if (!is_before_pole || !(glm::distance(Distorted(d, p), wanted) < kConverged)) return std::nullopt;
  return p;
}

}  // namespace

glm::dvec3 DirectionFromPixel(const Camera& camera, const glm::dvec2& pixel) {
  const glm::dvec2 wanted((pixel.x - camera.cx) / camera.fx, (pixel.y - camera.cy) / camera.fy);
  if (const auto p = Undistorted(camera.distortion, wanted, wanted)) return glm::normalize(glm::dvec3(*p, 1.0));
  // Followed outwards from the axis, each place from the one before; beyond a fold, the last that a direction reaches.
  constexpr int kWay = 64;
  glm::dvec2 p(0.0);
  for (int i = 1; i <= kWay; ++i) {
    const auto next = Undistorted(camera.distortion, wanted * (static_cast<double>(i) / kWay), p);
    if (!next) break;
    p = *next;
  }
  return glm::normalize(glm::dvec3(p, 1.0));
}

}  // namespace crownfit
