#include "viewer/mesh_capture.h"

#include <cmath>

#include "base/error.h"
#include "geometry/mesh_file.h"
#include "optics/material_file.h"

namespace crownfit {
namespace {

constexpr int kPicture_px = 900;

/// Replaces the table's defaults by the material's values: geometry is built from the values that the capture states.
void StateValues(Capture& capture, const Material& material) {
  for (size_t l = 0; l < capture.layers.size(); ++l)
    for (size_t q = 0; q < kParameters.size(); ++q)
      capture.layers[l].parameters[q].value = material.layers[l].values[q];
  for (size_t q = 0; q < kParameters.size(); ++q) capture.surface[q].value = material.surface.values[q];
}

/// A square softbox that shines on `middle` from `direction` (unit). `size_mm` is the crown's size.
Light Softbox(const char* name, const glm::dvec3& middle, const glm::dvec3& direction, double size_mm, int channels) {
  const auto [u, v] = Tangents(-direction);
  Light light;
  light.name = name;
  light.shape =
      RectangleLight{middle + 2.5 * size_mm * direction, 0.4 * size_mm * u, 0.4 * size_mm * v, Spectrum(channels, 4.5)};
  return light;
}

PhotographSpec PhotographOf(const glm::dvec3& middle, double size_mm) {
  PhotographSpec photo;
  photo.name = "default";
  photo.key = "--mesh";
  photo.camera.width = photo.camera.height = kPicture_px;
  photo.camera.fx = photo.camera.fy = 0.95 * kPicture_px * 3;
  photo.camera.cx = photo.camera.cy = 0.5 * kPicture_px;
  const glm::dmat3 front(glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, -1));
  photo.camera_from_object = {front, glm::dvec3(0, 0, 3 * size_mm) - front * middle};
  return photo;
}

}  // namespace

Capture CaptureOfMeshes(const std::vector<std::filesystem::path>& meshes, const std::filesystem::path& material_file) {
  const MaterialOutline outline = ReadMaterialOutline(material_file);
  if (meshes.size() > outline.layers.size())
    throw InputError(
        meshes[outline.layers.size()], "--mesh",
        "is one mesh more than the " + std::to_string(outline.layers.size()) + " layers of " + material_file.string(),
        "Give at most one mesh for each layer, outermost first.");
  glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const auto& mesh : meshes) {
    const auto bounds = Bounds(ReadMeshFile(mesh));
    low = glm::min(low, bounds.first);
    high = glm::max(high, bounds.second);
  }
  const glm::dvec3 middle = 0.5 * (low + high);
  const double size_mm = glm::distance(low, high);
  Capture capture = CaptureOfOutline(outline, material_file);
  for (size_t i = 0; i < meshes.size(); ++i) capture.layers[i].surface = meshes[i];
  capture.lights.push_back(
      Softbox("left", middle, glm::normalize(glm::dvec3(-1, 0.7, 1)), size_mm, capture.channels()));
  capture.lights.push_back(
      Softbox("right", middle, glm::normalize(glm::dvec3(1, 0.5, 1.2)), size_mm, capture.channels()));
  Light dome;
  dome.name = "dome";
  dome.shape = DomeLight{Spectrum(capture.channels(), 0.05)};
  capture.lights.push_back(dome);
  PhotographSpec photo = PhotographOf(middle, size_mm);
  for (size_t l = 0; l < capture.lights.size(); ++l) photo.lights.push_back(l);
  capture.photographs.push_back(photo);
  StateValues(capture, ReadMaterialFile(material_file, capture));
  return capture;
}

}  // namespace crownfit
