#include <cmath>

#include "base/files.h"
#include "exchange/equivalents.h"
#include "exchange/exporters.h"

// pbrt-v4. Its camera looks along +z with x to the right and y up. Its lamps are objects: they block light and are
// visible.

namespace crownfit {
namespace {

std::string Rgb(const char* name, const Spectrum& v) {
  return " \"rgb " + std::string(name) + "\" [" + NumberText(v.Expanded(3), " ") + "]";
}
std::string Float(const char* name, double v) { return " \"float " + std::string(name) + "\" " + NumberText(v); }
std::string Mesh(const std::string& file) { return "Shape \"plymesh\" \"string filename\" \"" + file + "\"\n"; }
std::string Diffuse(const Spectrum& reflectance) {
  return "Material \"diffuse\"" + Rgb("reflectance", reflectance) + "\n";
}

std::string InBlock(const std::string& text) { return "AttributeBegin\n" + text + "AttributeEnd\n"; }

std::vector<std::string> LayerNames(const ExportScene& scene) {
  std::vector<std::string> names;
  for (const ExportedLayer& layer : scene.layers) names.push_back(layer.name);
  return FileNames(names);
}

std::string MaterialText(const ExportScene& scene) {
  const std::vector<std::string> names = LayerNames(scene);
  std::string text = "# Coefficients in 1/mm, lengths in mm. To be included after WorldBegin.\n";
  for (size_t l = 0; l < scene.layers.size(); ++l) {
    const ExportedLayer& layer = scene.layers[l];
    const double outside = l == 0 ? scene.outside_ior : scene.layers[l - 1].ior;
    text += "MakeNamedMedium \"medium_" + names[l] + "\" \"string type\" \"homogeneous\"" +
            Rgb("sigma_s", layer.scattering_per_mm) + Rgb("sigma_a", layer.absorption_per_mm) +
            Float("g", MeanCosine(layer)) + "\n";
    if (layer.ior == outside) {
      text += "MakeNamedMaterial \"boundary_" + names[l] + "\" \"string type\" \"interface\"\n";
      continue;
    }
    text += "MakeNamedMaterial \"boundary_" + names[l] + "\" \"string type\" \"dielectric\"" +
            Float("eta", layer.ior / outside) + " \"bool remaproughness\" false" +
            Float("roughness", l == 0 && scene.roughness >= kSmoothBelow ? scene.roughness : 0.0) + "\n";
  }
  return text;
}

std::string CameraText(const ExportedPhotograph& photo, const std::string& name) {
  const Camera& camera = photo.camera;
  const RigidTransform& t = photo.camera_from_object;
  std::string matrix;
  for (int column = 0; column < 3; ++column)
    matrix += NumberText(glm::dvec3(1, -1, 1) * t.rotation[column], " ") + " 0 ";
  matrix += NumberText(glm::dvec3(1, -1, 1) * t.translation_mm, " ") + " 1";
  const double left = -camera.cx / camera.fx, right = (camera.width - camera.cx) / camera.fx;
  const double bottom = -(camera.height - camera.cy) / camera.fy, top = camera.cy / camera.fy;
  return "Transform [" + matrix + "]\nCamera \"perspective\"" + Float("fov", 90) + " \"float screenwindow\" [" +
         NumberText(left) + " " + NumberText(right) + " " + NumberText(bottom) + " " + NumberText(top) +
         "]\nSampler \"independent\" \"integer pixelsamples\" 256\n"
         "PixelFilter \"box\" \"float xradius\" 0.5 \"float yradius\" 0.5\n"
         "Integrator \"volpath\" \"integer maxdepth\" 100000 \"bool regularize\" false\n"
         "Film \"rgb\" \"integer xresolution\" " +
         std::to_string(camera.width) + " \"integer yresolution\" " + std::to_string(camera.height) +
         " \"bool savefp16\" false \"string filename\" \"" + name + ".exr\"\n";
}

std::string ObjectText(const ExportScene& scene, const MeshNames& meshes) {
  const std::vector<std::string> names = LayerNames(scene);
  std::string text;
  for (size_t l = 0; l < scene.surfaces.size(); ++l) {
    const std::string media =
        "MediumInterface \"medium_" + names[l] + "\" \"" + (l > 0 ? "medium_" + names[l - 1] : "") + "\"\n";
    text += InBlock(media + "NamedMaterial \"boundary_" + names[l] + "\"\n" + Mesh(meshes.layer[l]));
    if (!meshes.cut[l].empty()) text += InBlock(media + Diffuse(scene.neck_reflectance) + Mesh(meshes.cut[l]));
  }
  return text;
}

std::string LampText(const ExportedLamp& lamp, const std::string& mesh) {
  if (std::holds_alternative<DomeLamp>(lamp.shape)) return "LightSource \"infinite\"" + Rgb("L", lamp.radiance) + "\n";
  const std::string area = "AreaLightSource \"diffuse\"" + Rgb("L", lamp.radiance) + "\n" + Diffuse(Spectrum(0.0));
  const auto* ball = std::get_if<BallLamp>(&lamp.shape);
  if (!ball) return InBlock(area + Mesh(mesh));
  return InBlock("Translate " + NumberText(ball->centre_mm, " ") + "\n" + area + "Shape \"sphere\"" +
                 Float("radius", ball->radius_mm) + "\n");
}

}  // namespace

void WritePbrt(const ExportScene& scene, const std::filesystem::path& folder) {
  WriteTextFile(folder / "material.pbrt", MaterialText(scene));
  WriteMeshes(scene, folder);
  const MeshNames meshes = MeshNamesOf(scene);
  std::vector<std::string> names;
  for (const ExportedPhotograph& photo : scene.photographs) names.push_back(photo.name);
  names = FileNames(names, "material");
  for (size_t p = 0; p < names.size(); ++p) {
    const ExportedPhotograph& photo = scene.photographs[p];
    std::string text =
        CameraText(photo, names[p]) + "WorldBegin\nInclude \"material.pbrt\"\n" + ObjectText(scene, meshes);
    for (size_t i = 0; i < photo.things.size(); ++i)
      text += InBlock(Diffuse(photo.things[i].reflectance) + Mesh(meshes.thing[p][i]));
    for (size_t i = 0; i < photo.lamps.size(); ++i)
      if (!std::holds_alternative<EnvironmentLamp>(photo.lamps[i].shape))  // its maps are equal-area squares
        text += LampText(photo.lamps[i], meshes.lamp[p][i]);
    WriteTextFile(folder / (names[p] + ".pbrt"), text);
  }
}

}  // namespace crownfit
