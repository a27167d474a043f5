#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <pugixml.hpp>
#include <sstream>

#include "base/files.h"
#include "exchange/exporters.h"

// How crownfit's quantities are expressed for Mitsuba 3:
// * Lamps of crownfit block nothing and the camera does not see them. Area emitters carry the BSDF `null` (rays run
//   through and collect the radiance on the way), and the integrator hides emitters at depth 0.
// * An inner surface lies between two media and names both; its indices are those of the two layers.
// * `sample_emitters` of a medium is off: a line to a lamp always meets a dielectric boundary first.
// * Channels scatter differently: volpathmis combines the ways of choosing a free path for all of them (Miller,
//   Georgiev and Jarosz 2019).
// * Russian roulette kills at least 5 % at every event once it has begun, so it begins late.
// * Values of <rgb> spectra in media are taken as colours, up to 1; `scale` carries the size.
// * The camera looks along +z with x to the left and y up.

namespace crownfit {
namespace {

using Node = pugi::xml_node;

/// <TAG type="TYPE" name="NAME">; either may be empty.
Node Add(Node parent, const char* tag, const std::string& type, const std::string& name = "") {
  Node node = parent.append_child(tag);
  if (!type.empty()) node.append_attribute("type") = type.c_str();
  if (!name.empty()) node.append_attribute("name") = name.c_str();
  return node;
}

/// <TAG name="NAME" value="VALUE"/>
void Set(Node parent, const char* tag, const char* name, const std::string& value) {
  Node node = parent.append_child(tag);
  node.append_attribute("name") = name;
  node.append_attribute("value") = value.c_str();
}
void SetFloat(Node parent, const char* name, double value) { Set(parent, "float", name, NumberText(value)); }
/// How values per channel are written: three as <rgb>, any other number as <spectrum> over wavelengths.
class Channels {
 public:
  explicit Channels(const ExportScene& scene) : names_(scene.channel_names), nm_(scene.wavelengths_nm) {
    ascending_.resize(nm_.size());
    std::iota(ascending_.begin(), ascending_.end(), size_t{0});
    std::ranges::stable_sort(ascending_, {}, [this](size_t c) { return nm_[c]; });
  }
  bool are_rgb() const { return nm_.size() == 3; }
  void Set(Node parent, const char* name, const Spectrum& value) const {
    const Spectrum values = value.Expanded(static_cast<int>(nm_.size()));
    if (are_rgb()) return crownfit::Set(parent, "rgb", name, NumberText(values, ", "));
    std::string text;
    double last_nm = 0;
    for (const size_t c : ascending_) {
      if (nm_[c] <= last_nm) continue;  // Mitsuba wants wavelengths that rise
      last_nm = nm_[c];
      text += (text.empty() ? "" : ", ") + NumberText(nm_[c]) + ":" + NumberText(values[static_cast<int>(c)]);
    }
    // One wavelength is one value for all.
    crownfit::Set(parent, "spectrum", name, text.find(',') == text.npos ? NumberText(values[0]) : text);
  }
  /// The film: of spectra it has a narrow band for each channel, `name`.
  Node AddFilm(Node sensor) const {
    constexpr double kHalfBand_nm = 1.0;
    Node film = Add(sensor, "film", are_rgb() ? "hdrfilm" : "specfilm");
    if (are_rgb()) crownfit::Set(film, "string", "pixel_format", "rgb");
    for (size_t c = 0; c < nm_.size() && !are_rgb(); ++c)
      crownfit::Set(film, "spectrum", FileNames(names_)[c].c_str(),
                    NumberText(nm_[c] - kHalfBand_nm) + ":1, " + NumberText(nm_[c] + kHalfBand_nm) + ":1");
    return film;
  }

 private:
  const std::vector<std::string>& names_;
  const std::vector<double>& nm_;
  std::vector<size_t> ascending_;
};

void Refer(Node parent, const std::string& id, const char* name = "") {
  Node node = Add(parent, "ref", "", name);
  node.append_attribute("id") = id.c_str();
}

/// Rows of the camera-to-world matrix, or of a ball's scale matrix.
void SetMatrix(Node parent, const glm::dmat3& columns, const glm::dvec3& origin) {
  std::string text;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) text += NumberText(columns[column][row]) + " ";
    text += NumberText(origin[row]) + " ";
  }
  Node transform = Add(parent, "transform", "", "to_world");
  transform.append_child("matrix").append_attribute("value") = (text + "0 0 0 1").c_str();
}

void AddMedium(Node parent, const ExportedLayer& layer, const Channels& channels, const std::string& id) {
  const Spectrum extinction = layer.scattering_per_mm + layer.absorption_per_mm;
  const double largest = extinction.Largest();
  const double scale = largest > 0 ? largest : 1.0;
  Spectrum albedo(extinction.size(), 0.0);
  for (int c = 0; c < albedo.size(); ++c)
    if (extinction[c] > 0) albedo[c] = layer.scattering_per_mm[c] / extinction[c];
  Node medium = Add(parent, "medium", "homogeneous");
  medium.append_attribute("id") = id.c_str();
  channels.Set(medium, "sigma_t", extinction / scale);
  SetFloat(medium, "scale", scale);
  channels.Set(medium, "albedo", albedo);
  Set(medium, "boolean", "sample_emitters", "false");
  if (layer.isotropic_fraction == 0) {
    SetFloat(Add(medium, "phase", "hg"), "g", layer.asymmetry);
    return;
  }
  Node blend = Add(medium, "phase", "blendphase");
  SetFloat(blend, "weight", layer.isotropic_fraction);  // of the second phase function
  SetFloat(Add(blend, "phase", "hg"), "g", layer.asymmetry);
  Add(blend, "phase", "isotropic");
}

void AddBoundary(Node parent, double inside, double outside, double roughness, const std::string& id) {
  const char* type = inside == outside ? "null" : roughness < kSmoothBelow ? "dielectric" : "roughdielectric";
  Node bsdf = Add(parent, "bsdf", type);
  bsdf.append_attribute("id") = id.c_str();
  if (inside == outside) return;
  SetFloat(bsdf, "int_ior", inside);
  SetFloat(bsdf, "ext_ior", outside);
  if (roughness < kSmoothBelow) return;
  Set(bsdf, "string", "distribution", "ggx");
  SetFloat(bsdf, "alpha", roughness);
}

Node AddMesh(Node parent, const std::string& file) {
  Node shape = Add(parent, "shape", "ply");
  Set(shape, "string", "filename", file);
  Set(shape, "boolean", "face_normals", "true");
  return shape;
}

void SetDiffuse(Node parent, const Spectrum& reflectance, const Channels& channels) {
  channels.Set(Add(parent, "bsdf", "diffuse"), "reflectance", reflectance);
}

struct LayerNames {
  std::vector<std::string> medium, boundary;
};
LayerNames NamesOf(const ExportScene& scene) {
  LayerNames names;
  for (const ExportedLayer& layer : scene.layers) names.medium.push_back(layer.name);
  names.medium = FileNames(names.medium);
  for (std::string& name : names.medium) {
    names.boundary.push_back("boundary_" + name);
    name = "medium_" + name;
  }
  return names;
}

void WriteXml(const std::filesystem::path& file, const pugi::xml_document& document) {
  std::ostringstream text;
  document.save(text, "  ");
  WriteTextFile(file, text.str());
}

Node Begin(pugi::xml_document& document) {
  Node scene = document.append_child("scene");
  scene.append_attribute("version") = "3.0.0";
  return scene;
}

Node AddLamp(Node root, const ExportedLamp& lamp, const Channels& channels, const std::string& mesh) {
  if (std::holds_alternative<DomeLamp>(lamp.shape)) {
    Node dome = Add(root, "emitter", "constant");
    channels.Set(dome, "radiance", lamp.radiance);
    return dome;
  }
  if (std::holds_alternative<EnvironmentLamp>(lamp.shape)) {
    Node map = Add(root, "emitter", "envmap");
    Set(map, "string", "filename", mesh);
    return map;
  }
  const auto* ball = std::get_if<BallLamp>(&lamp.shape);
  Node shape = ball ? Add(root, "shape", "sphere") : AddMesh(root, mesh);
  if (ball) SetMatrix(shape, glm::dmat3(ball->radius_mm), ball->centre_mm);
  Add(shape, "bsdf", "null");
  channels.Set(Add(shape, "emitter", "area"), "radiance", lamp.radiance);
  return shape;
}

void AddSensor(Node root, const Camera& camera, const RigidTransform& camera_from_object, const Channels& channels) {
  const double width = camera.width, height = camera.height;
  for (const auto& [name, value] : {std::pair{"width", camera.width}, {"height", camera.height}, {"spp", 256}})
    Set(root, "default", name, std::to_string(value));
  Node sensor = Add(root, "sensor", "perspective");
  Set(sensor, "string", "fov_axis", "x");
  SetFloat(sensor, "fov", 2.0 * std::atan(0.5 * width / camera.fx) * 180.0 / std::numbers::pi);
  SetFloat(sensor, "principal_point_offset_x", 0.5 - camera.cx / width);
  SetFloat(sensor, "principal_point_offset_y", 0.5 - camera.cy / height);
  SetFloat(sensor, "near_clip", 1.0);
  SetFloat(sensor, "far_clip", 1e5);
  const RigidTransform back = camera_from_object.Inverse();
  SetMatrix(sensor, glm::dmat3(-back.rotation[0], -back.rotation[1], back.rotation[2]), back.translation_mm);
  Node film = channels.AddFilm(sensor);
  Set(film, "integer", "width", "$width");
  Set(film, "integer", "height", "$height");
  Set(film, "string", "component_format", "float32");
  Add(film, "rfilter", "box");
  Set(Add(sensor, "sampler", "independent"), "integer", "sample_count", "$spp");
}

void AddObject(Node root, const ExportScene& scene, const MeshNames& meshes) {
  const LayerNames names = NamesOf(scene);
  for (size_t l = 0; l < scene.surfaces.size(); ++l) {
    Node surface = AddMesh(root, meshes.layer[l]);
    Refer(surface, names.boundary[l]);
    Refer(surface, names.medium[l], "interior");
    if (l > 0) Refer(surface, names.medium[l - 1], "exterior");
    if (meshes.cut[l].empty()) continue;
    Node cut = AddMesh(root, meshes.cut[l]);
    Node sides = Add(cut, "bsdf", "twosided");
    SetDiffuse(sides, Spectrum(0.0), Channels(scene));
    SetDiffuse(sides, scene.neck_reflectance, Channels(scene));
    Refer(cut, names.medium[l], "interior");
    if (l > 0) Refer(cut, names.medium[l - 1], "exterior");
  }
}

}  // namespace

void WriteMitsuba(const ExportScene& scene, const std::filesystem::path& folder) {
  const Channels channels(scene);
  const LayerNames names = NamesOf(scene);
  const MeshNames meshes = MeshNamesOf(scene);
  pugi::xml_document material;
  Node media = Begin(material);
  for (size_t l = 0; l < scene.layers.size(); ++l) {
    const double outside = l == 0 ? scene.outside_ior : scene.layers[l - 1].ior;
    AddMedium(media, scene.layers[l], channels, names.medium[l]);
    AddBoundary(media, scene.layers[l].ior, outside, l == 0 ? scene.roughness : 0.0, names.boundary[l]);
  }
  WriteXml(folder / "material.xml", material);
  WriteMeshes(scene, folder);
  std::vector<std::string> photographs;
  for (const ExportedPhotograph& photo : scene.photographs) photographs.push_back(photo.name);
  photographs = FileNames(photographs, "material");
  for (size_t p = 0; p < photographs.size(); ++p) {
    const ExportedPhotograph& photo = scene.photographs[p];
    pugi::xml_document document;
    Node root = Begin(document);
    Set(root, "default", "integrator", "volpathmis");
    Node integrator = Add(root, "integrator", "$integrator");
    Set(integrator, "integer", "max_depth", "-1");
    Set(integrator, "integer", "rr_depth", "100000");
    Set(integrator, "boolean", "hide_emitters", "true");
    AddSensor(root, photo.camera, photo.camera_from_object, channels);
    root.append_child("include").append_attribute("filename") = "material.xml";
    AddObject(root, scene, meshes);
    std::vector<std::string> things, lamps;  // names by which an import knows them again
    for (const ExportedThing& thing : photo.things) things.push_back(thing.name);
    for (const ExportedLamp& lamp : photo.lamps) lamps.push_back(lamp.name);
    things = FileNames(things), lamps = FileNames(lamps);
    for (size_t i = 0; i < things.size(); ++i) {
      Node thing = AddMesh(root, meshes.thing[p][i]);
      thing.append_attribute("id") = ("thing_" + things[i]).c_str();
      SetDiffuse(Add(thing, "bsdf", "twosided"), photo.things[i].reflectance, channels);
    }
    for (size_t i = 0; i < lamps.size(); ++i)
      AddLamp(root, photo.lamps[i], channels, meshes.lamp[p][i]).append_attribute("id") = ("lamp_" + lamps[i]).c_str();
    WriteXml(folder / (photographs[p] + ".xml"), document);
  }
}

}  // namespace crownfit
