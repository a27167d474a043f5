#include <charconv>

#include "base/error.h"
#include "exchange/exporters.h"
#include "geometry/mesh_file.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

/// Writes the mesh without its per-vertex properties.
void WriteShape(const std::filesystem::path& file, TriangleMesh mesh) {
  mesh.vertex_properties.clear();
  WritePly(file, mesh);
}

bool HasCut(const ExportScene& scene, size_t layer) {
  return scene.neck_is_opaque && !CutPart(scene.surfaces[layer]).triangles.empty();
}

}  // namespace

MeshNames MeshNamesOf(const ExportScene& scene) {
  MeshNames names;
  std::vector<std::string> layers, photographs;
  for (const ExportedLayer& layer : scene.layers) layers.push_back(layer.name);
  for (const ExportedPhotograph& photo : scene.photographs) photographs.push_back(photo.name);
  layers = FileNames(layers), photographs = FileNames(photographs);
  for (size_t l = 0; l < scene.surfaces.size(); ++l) {
    names.layer.push_back("meshes/layer_" + layers[l] + ".ply");
    names.cut.push_back(HasCut(scene, l) ? "meshes/cut_" + layers[l] + ".ply" : "");
  }
  for (size_t p = 0; p < scene.photographs.size(); ++p) {
    const ExportedPhotograph& photo = scene.photographs[p];
    std::vector<std::string> lamps, things;
    for (const ExportedLamp& lamp : photo.lamps) lamps.push_back(lamp.name);
    for (const ExportedThing& thing : photo.things) things.push_back(thing.name);
    lamps = FileNames(lamps), things = FileNames(things);
    for (size_t i = 0; i < lamps.size(); ++i) {
      const auto& shape = photo.lamps[i].shape;
      const char* ending = std::holds_alternative<TriangleMesh>(shape)      ? ".ply"
                           : std::holds_alternative<EnvironmentLamp>(shape) ? ".exr"
                                                                            : nullptr;
      lamps[i] = ending ? "meshes/" + photographs[p] + "_lamp_" + lamps[i] + ending : "";
    }
    for (auto& thing : things) thing = "meshes/" + photographs[p] + "_thing_" + thing + ".ply";
    names.lamp.push_back(lamps);
    names.thing.push_back(things);
  }
  return names;
}

void WriteMeshes(const ExportScene& scene, const std::filesystem::path& folder) {
  const MeshNames names = MeshNamesOf(scene);
  for (size_t l = 0; l < scene.surfaces.size(); ++l) {
    const TriangleMesh& surface = scene.surfaces[l];
    const bool has_cut = !names.cut[l].empty();
    WriteShape(folder / names.layer[l], has_cut ? ScannedPart(surface) : surface);
    if (has_cut) WriteShape(folder / names.cut[l], CutPart(surface));
  }
  for (size_t p = 0; p < scene.photographs.size(); ++p) {
    const ExportedPhotograph& photo = scene.photographs[p];
    for (size_t i = 0; i < photo.things.size(); ++i) WriteShape(folder / names.thing[p][i], photo.things[i].mesh);
    for (size_t i = 0; i < photo.lamps.size(); ++i) {
      const auto& shape = photo.lamps[i].shape;
      if (const auto* mesh = std::get_if<TriangleMesh>(&shape)) WriteShape(folder / names.lamp[p][i], *mesh);
      if (const auto* environment = std::get_if<EnvironmentLamp>(&shape))
        WriteImageFile(folder / names.lamp[p][i], environment->radiance);
    }
  }
}

std::string NumberText(double v) {
  char buffer[40];
  const auto [end, error] = std::to_chars(buffer, buffer + sizeof buffer, v);
  Check(error == std::errc(), "a double has a decimal form");
  return std::string(buffer, end);
}

std::string NumberText(const Spectrum& v, const char* between) {
  std::string text;
  for (const double value : v) text += (text.empty() ? "" : between) + NumberText(value);
  return text;
}

std::string NumberText(const glm::dvec3& v, const char* between) {
  return NumberText(v.x) + between + NumberText(v.y) + between + NumberText(v.z);
}

}  // namespace crownfit
