#include <string_view>

#include "base/files.h"
#include "exchange/equivalents.h"
#include "exchange/exporters.h"

// A Python script for Blender: the numbers of this export, then src/exchange/blender_scene.py unchanged.

namespace crownfit {

std::string_view BlenderScript();

namespace {

JsonValue List(const Spectrum& v) { return v.Expanded(3).list(); }
JsonValue List(const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; }

JsonValue LampJson(const ExportedLamp& lamp, const std::string& file) {
  JsonValue::Object json{{"name", lamp.name}, {"radiance", List(lamp.radiance)}};
  if (const auto* ball = std::get_if<BallLamp>(&lamp.shape)) {
    json.emplace_back("type", "ball");
    json.emplace_back("centre_mm", List(ball->centre_mm));
    json.emplace_back("radius_mm", ball->radius_mm);
    return json;
  }
  json.emplace_back("type", std::holds_alternative<DomeLamp>(lamp.shape)          ? "dome"
                            : std::holds_alternative<EnvironmentLamp>(lamp.shape) ? "environment"
                                                                                  : "mesh");
  json.emplace_back("file", file);
  return json;
}

JsonValue PhotographJson(const ExportedPhotograph& photo, const std::vector<std::string>& lamp_files,
                         const std::vector<std::string>& thing_files) {
  JsonValue::Array lamps, things, matrix;
  for (size_t i = 0; i < photo.lamps.size(); ++i) lamps.push_back(LampJson(photo.lamps[i], lamp_files[i]));
  for (size_t i = 0; i < photo.things.size(); ++i)
    things.push_back(JsonValue::Object{
        {"name", photo.things[i].name}, {"file", thing_files[i]}, {"reflectance", List(photo.things[i].reflectance)}});
  // Blender's camera looks along -z with y up.
  const RigidTransform back = photo.camera_from_object.Inverse();
  const glm::dmat3 turned(back.rotation[0], -back.rotation[1], -back.rotation[2]);
  for (int row = 0; row < 3; ++row)
    matrix.emplace_back(std::vector<double>{turned[0][row], turned[1][row], turned[2][row], back.translation_mm[row]});
  matrix.emplace_back(std::vector<double>{0, 0, 0, 1});
  return JsonValue::Object{{"name", photo.name},
                           {"width", photo.camera.width},
                           {"height", photo.camera.height},
                           {"focal_px", photo.camera.fx},
                           {"cx", photo.camera.cx},
                           {"cy", photo.camera.cy},
                           {"world_from_camera", matrix},
                           {"lamps", lamps},
                           {"things", things}};
}

}  // namespace

void WriteBlender(const ExportScene& with_neck, const std::filesystem::path& folder) {
  ExportScene scene = with_neck;
  scene.neck_is_opaque = false;  // volumes need closed meshes
  WriteMeshes(scene, folder);
  const MeshNames meshes = MeshNamesOf(scene);
  const ExportedLayer one = OneMediumFor(scene);
  JsonValue::Array layers, photographs;
  for (size_t l = 0; l < scene.layers.size(); ++l) {
    const ExportedLayer& layer = scene.layers[l];
    const double outside = l == 0 ? scene.outside_ior : scene.layers[l - 1].ior;
    layers.push_back(JsonValue::Object{{"name", layer.name},
                                       {"mesh", l < meshes.layer.size() ? meshes.layer[l] : ""},
                                       {"relative_ior", layer.ior / outside},
                                       {"g", MeanCosine(layer)},
                                       {"scattering_per_mm", List(layer.scattering_per_mm)},
                                       {"absorption_per_mm", List(layer.absorption_per_mm)}});
  }
  for (size_t p = 0; p < scene.photographs.size(); ++p)
    photographs.push_back(PhotographJson(scene.photographs[p], meshes.lamp[p], meshes.thing[p]));
  // Cycles walks with the extinction 1 / (radius (1 - g)), and without g here: its conversion from albedo to scattering
  // is inaccurate for g = 0.9, where it ends at 0.7. By the similarity relation reduced, isotropic scattering is
  // exported.
  const JsonValue numbers =
      JsonValue::Object{{"one_medium", JsonValue::Object{{"ior", one.ior / scene.outside_ior},
                                                         {"albedo", List(AlbedoBehindSurface(one, scene.outside_ior))},
                                                         {"radius_mm", List(TransportMeanFreePath_mm(one))}}},
                        {"roughness", scene.roughness},
                        {"layers", layers},
                        {"photographs", photographs}};
  WriteTextFile(folder / "crown.py", "# Lengths in mm, coefficients in 1/mm; one Blender unit is 1 mm.\nSCENE = " +
                                         ToJsonText(numbers) + std::string(BlenderScript()));
}

}  // namespace crownfit
