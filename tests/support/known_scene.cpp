#include "support/known_scene.h"

#include <algorithm>

#include "capture/capture.h"
#include "scene/build_crown.h"
#include "scene/cast_photograph.h"
#include "scene/cast_samples.h"
#include "scene/crown_source.h"
#include "support/shapes.h"

namespace crownfit {

KnownScene::KnownScene(TriangleMesh outer, int layers, double thickness_mm, int pixels, double view_mm) {
  capture.file = "known_scene";
  for (int l = 0; l < layers; ++l) {
    LayerSpec layer;
    layer.name = l == 0 ? "outer" : "inner";
    for (size_t i = 0; i < kParameters.size(); ++i) layer.parameters[i] = DefaultSpec(kParameters[i]);
    layer[Quantity::kThickness].value.fill(thickness_mm);
    capture.layers.push_back(layer);
  }
  for (size_t i = 0; i < kParameters.size(); ++i) capture.surface[i] = DefaultSpec(kParameters[i]);
  PhotographSpec photo;
  photo.name = "only";
  photo.camera.width = photo.camera.height = pixels;
  photo.camera.fx = photo.camera.fy = pixels * 250.0 / view_mm;
  photo.camera.cx = photo.camera.cy = 0.5 * pixels;
  photo.camera_from_object.rotation = glm::dmat3(glm::dvec3(1, 0, 0), glm::dvec3(0, -1, 0), glm::dvec3(0, 0, -1));
  photo.camera_from_object.translation_mm = {0, 0, 250};
  capture.photographs.push_back(photo);
  source.meshes.emplace_back(std::move(outer));
  source.fields.resize(layers);
  source.thickness.resize(layers);
  source.absorption.resize(layers);
  for (int l = 1; l < layers; ++l) source.meshes.emplace_back();
  if (layers > 1) source.fields[0] = std::make_shared<DepthField>(*source.meshes[0], 0);
}

void KnownScene::Light(const LightShape& shape) {
  crownfit::Light light;
  light.name = "light" + std::to_string(capture.lights.size());
  light.shape = shape;
  if (auto* disk = std::get_if<DiskLight>(&light.shape)) disk->normal = glm::normalize(disk->normal);
  capture.photographs[0].lights.push_back(capture.lights.size());
  capture.lights.push_back(light);
}

std::shared_ptr<const Crown> KnownScene::Build() const {
  return BuildCrown(capture, source, StatedThicknesses(capture), 0);
}

PhotographCast KnownScene::Cast(const Crown& crown, const CastOptions& options) const {
  return CastPhotograph(capture, crown, scenery, 0, options);
}

KnownScene SmoothIncisor(int pixels, bool has_softbox, std::optional<TriangleMesh> crown) {
  KnownScene scene(crown ? std::move(*crown) : Incisor(), 2, 0.9, pixels, 12.0);
  const double common[2][3] = {{1.63, 0.68, 6.6 * 0.32}, {1.54, 0.93, 28 * 0.07}};
  const Spectrum absorption[2] = {{0.01, 0.03, 0.08}, {0.03, 0.1, 0.3}};
  for (int l = 0; l < 2; ++l) {
    LayerSpec& layer = scene.capture.layers[l];
    layer[Quantity::kIor].value.fill(common[l][0]);
    layer[Quantity::kAsymmetry].value.fill(common[l][1]);
    layer[Quantity::kReducedScattering].value.fill(common[l][2]);
    layer[Quantity::kAbsorption].value = absorption[l];
  }
  scene.capture.surface[static_cast<size_t>(Quantity::kRoughness)].value.fill(0.0);
  if (has_softbox) scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 66.9});
  scene.Light(DomeLight{glm::dvec3(has_softbox ? 0.05 : 1.0)});
  return scene;
}

}  // namespace crownfit
