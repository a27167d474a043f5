#include "studio_capture.h"

#include <cmath>
#include <numbers>

#include "geometry/triangle_mesh.h"

namespace crownfit {
namespace {

/// The camera's position and its right and up directions, about the object's middle.
struct Studio {
  glm::dvec3 middle, right, up, front;
  double size_mm;
  int channels;

  /// Direction to a point `around_deg` around the upright axis from the camera, and `above_deg` above it.
  glm::dvec3 Direction(double around_deg, double above_deg) const {
    const double a = around_deg * std::numbers::pi / 180, b = above_deg * std::numbers::pi / 180;
    return std::cos(b) * (std::sin(a) * right + std::cos(a) * front) + std::sin(b) * up;
  }
};

Light Softbox(const Studio& studio, double around_deg, double above_deg) {
  const glm::dvec3 direction = studio.Direction(around_deg, above_deg);
  const auto [u, v] = Tangents(-direction);
  Light light;
  light.name =
      "softbox " + std::to_string(static_cast<int>(around_deg)) + " " + std::to_string(static_cast<int>(above_deg));
  light.shape = RectangleLight{studio.middle + 4.0 * studio.size_mm * direction, 1.5 * studio.size_mm * u,
                               1.5 * studio.size_mm * v, Spectrum(studio.channels, 2.0)};
  return light;
}

BackingSpec Tile(const Studio& studio, const char* name, double reflectance, double depth_mm) {
  BackingSpec tile;
  tile.name = name;
  tile.point_mm = studio.middle - (0.5 * depth_mm + 0.5) * studio.front;
  tile.normal = studio.front;
  tile.size_mm = 3 * studio.size_mm;
  tile.reflectance = Spectrum(studio.channels, reflectance);
  return tile;
}

}  // namespace

Capture StudioCapture(const Capture& capture, const glm::dvec3& low, const glm::dvec3& high, int pixels) {
  const PhotographSpec& first = capture.photographs[0];
  const glm::dmat3 object_from_camera = glm::transpose(first.camera_from_object.rotation);
  Studio studio{0.5 * (low + high), object_from_camera[0], -object_from_camera[1], -object_from_camera[2], 0,
                capture.channels()};
  studio.size_mm = glm::distance(low, high);
  const double depth_mm = glm::dot(glm::abs(studio.front), high - low);

  Capture lit = capture;
  lit.lights.clear();
  lit.photographs.clear();
  lit.scenery.clear();
  lit.measurements.clear();
  lit.backings = {Tile(studio, "white", 0.9, depth_mm), Tile(studio, "grey", 0.4, depth_mm)};
  PhotographSpec base;
  base.key = "studio";
  base.polarisation = Polarisation::kCross;
  base.camera.width = base.camera.height = pixels;
  base.camera.fx = base.camera.fy = 0.95 * pixels * 10;
  base.camera.cx = base.camera.cy = 0.5 * pixels;
  base.camera_from_object.rotation = first.camera_from_object.rotation;
  base.camera_from_object.translation_mm =
      glm::dvec3(0, 0, 10 * studio.size_mm) - base.camera_from_object.rotation * studio.middle;
  const auto add = [&](const char* name, const std::vector<Light>& lights, std::optional<size_t> backing,
                       bool is_holdout) {
    PhotographSpec photo = base;
    photo.name = name;
    photo.backing = backing;
    photo.is_holdout = is_holdout;
    for (const Light& light : lights) {
      photo.lights.push_back(lit.lights.size());
      lit.lights.push_back(light);
    }
    lit.photographs.push_back(photo);
  };
  const auto box = [&](double around_deg, double above_deg) { return Softbox(studio, around_deg, above_deg); };
  Light dome;
  dome.name = "dome";
  dome.shape = DomeLight{Spectrum(capture.channels(), 0.3)};
  add("front", {box(-40, 20), box(40, 20)}, {}, false);
  add("front, white tile", {box(-40, 20), box(40, 20)}, 0, false);
  add("from above", {box(20, 50)}, {}, false);
  add("dome", {dome}, {}, false);
  add("from high above, grey tile", {box(-10, 65)}, 1, true);
  add("beside the camera", {box(15, -10)}, {}, true);
  add("left", {box(-100, 10)}, {}, true);
  add("behind", {box(180, 0)}, {}, true);
  return lit;
}

}  // namespace crownfit
