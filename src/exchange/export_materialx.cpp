#include <pugixml.hpp>
#include <sstream>

#include "base/files.h"
#include "exchange/equivalents.h"
#include "exchange/exporters.h"

namespace crownfit {
namespace {

void AddInput(pugi::xml_node node, const char* name, const char* type, const std::string& value) {
  pugi::xml_node input = node.append_child("input");
  input.append_attribute("name") = name;
  input.append_attribute("type") = type;
  input.append_attribute("value") = value.c_str();
}

/// OpenPBR 1.1: roughness squared is GGX's alpha; subsurface_radius x subsurface_radius_scale is the mean free path;
/// subsurface_color is the multiple-scattering albedo, which programs convert to the single-scattering albedo.
void AddMaterial(pugi::xml_node root, const ExportedLayer& medium, const std::string& name, const ExportScene& scene) {
  const Spectrum path = MeanFreePath_mm(medium);
  const double longest = path.Largest();
  pugi::xml_node shader = root.append_child("open_pbr_surface");
  shader.append_attribute("name") = ("shader_" + name).c_str();
  shader.append_attribute("type") = "surfaceshader";
  shader.append_attribute("doc") = "OpenPBR 1.1; lengths in millimetres; channels are the bands of the capture";
  AddInput(shader, "geometry_thin_walled", "boolean", "false");
  AddInput(shader, "base_weight", "float", "1");
  AddInput(shader, "subsurface_weight", "float", "1");
  AddInput(shader, "subsurface_color", "color3", NumberText(MultipleScatteringAlbedo(medium), ", "));
  AddInput(shader, "subsurface_radius", "float", NumberText(longest));
  AddInput(shader, "subsurface_radius_scale", "color3", NumberText(path / longest, ", "));
  AddInput(shader, "subsurface_scatter_anisotropy", "float", NumberText(MeanCosine(medium)));
  AddInput(shader, "specular_weight", "float", "1");
  AddInput(shader, "specular_ior", "float", NumberText(medium.ior / scene.outside_ior));
  AddInput(shader, "specular_roughness", "float", NumberText(std::sqrt(scene.roughness)));
  pugi::xml_node material = root.append_child("surfacematerial");
  material.append_attribute("name") = name.c_str();
  material.append_attribute("type") = "material";
  pugi::xml_node input = material.append_child("input");
  input.append_attribute("name") = "surfaceshader";
  input.append_attribute("type") = "surfaceshader";
  input.append_attribute("nodename") = ("shader_" + name).c_str();
}

}  // namespace

void WriteMaterialX(const ExportScene& scene, const std::filesystem::path& folder) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("materialx");
  root.append_attribute("version") = "1.39";
  // No colour space is stated: the channels are the capture's bands, not primaries (exchange.md).
  const ExportedLayer all = OneMediumFor(scene);
  std::vector<std::string> names{"all_layers"};
  for (const ExportedLayer& layer : scene.layers) names.push_back("layer_" + layer.name);
  for (std::string& name : names) std::replace(name.begin(), name.end(), '-', '_');
  names = FileNames(names);
  AddMaterial(root, all, names[0], scene);
  for (size_t l = 0; l < scene.layers.size(); ++l) AddMaterial(root, scene.layers[l], names[l + 1], scene);
  std::ostringstream text;
  document.save(text, "  ");
  WriteTextFile(folder / "material.mtlx", text.str());
}

}  // namespace crownfit
