#include "exchange/import_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/files.h"
#include "capture/light_rig.h"
#include "exchange/export_scene.h"
#include "exchange/mitsuba_scene.h"
#include "geometry/mesh_file.h"
#include "optics/media.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Object = JsonValue::Object;

bool IsSame(const TriangleMesh& a, const TriangleMesh& b) {
  return a.vertices == b.vertices && a.triangles == b.triangles;
}

bool IsSame(const ImportedLayer& a, const ImportedLayer& b) {
  return a.name == b.name && a.ior == b.ior && a.asymmetry == b.asymmetry &&
         a.isotropic_fraction == b.isotropic_fraction && a.reduced_scattering_per_mm == b.reduced_scattering_per_mm &&
         a.absorption_per_mm == b.absorption_per_mm && IsSame(a.surface.mesh, b.surface.mesh);
}

bool IsSameObject(const ImportedScene& a, const ImportedScene& b) {
  return a.surface.outside_ior == b.surface.outside_ior && a.surface.roughness == b.surface.roughness &&
         a.surface.neck_reflectance == b.surface.neck_reflectance &&
         std::equal(a.layers.begin(), a.layers.end(), b.layers.begin(), b.layers.end(),
                    [](const auto& one, const auto& other) { return IsSame(one, other); });
}

/// The values within the range in which a fit may start.
JsonValue Starts(Quantity quantity, const Spectrum& values) {
  const ParameterRow& row = RowOf(quantity);
  return Object{{"initial", Min(Max(values, Spectrum(row.low)), Spectrum(row.high)).list()}};
}

Object LayerKeys(const ImportedLayer& layer) {
  Object keys{{"ior", Object{{"fixed", layer.ior}}},
              {"g", Object{{"fixed", layer.asymmetry}}},
              {"reduced_scattering_per_mm", Starts(Quantity::kReducedScattering, layer.reduced_scattering_per_mm)},
              {"absorption_per_mm", Starts(Quantity::kAbsorption, layer.absorption_per_mm)}};
  if (layer.isotropic_fraction > 0)
    keys.emplace_back("isotropic_fraction", Object{{"fixed", layer.isotropic_fraction}});
  return keys;
}

/// The neck's share of returned light, over that of the innermost layer.
double NeckReturn(const ImportedScene& scene, const Path& file) {
  const ImportedLayer& innermost = scene.layers.back();
  constexpr int kRgb = 3;
  double sum = 0, least = 1e300, most = 0;
  for (int c = 0; c < kRgb; ++c) {
    const double half_space =
        HalfSpaceReflectance(innermost.reduced_scattering_per_mm[c], innermost.absorption_per_mm[c]);
    const double ratio = half_space > 0 ? (*scene.surface.neck_reflectance)[c] / half_space : 0.0;
    sum += ratio, least = std::min(least, ratio), most = std::max(most, ratio);
  }
  const ParameterRow& row = RowOf(Quantity::kNeckReturn);
  if (most - least > 1e-3 * most || most > row.most)
    throw InputError(file, "", "the reflectance of the neck is no multiple of what the innermost layer returns",
                     "Make the neck black, or export it again with crownfit.");
  return sum / kRgb;
}

Object ObjectKeys(const ImportedScene& scene, const Path& file) {
  const double roughness = std::max(scene.surface.roughness, RowOf(Quantity::kRoughness).low);
  Object surface{{"roughness", Object{{"initial", roughness}}}}, keys;
  if (const auto& neck = scene.surface.neck_reflectance) {
    const bool is_black = *neck == glm::dvec3(0.0);
    keys.emplace_back("neck", is_black ? "absorbing" : "root");
    constexpr double kRounding = 1e-6;
    if (const double factor = is_black ? 1.0 : NeckReturn(scene, file); std::abs(factor - 1.0) > kRounding)
      surface.emplace_back("neck_return", Object{{"fixed", factor}});
  }
  keys.emplace_back("surface", surface);
  if (scene.surface.outside_ior != 1.0) keys.emplace_back("outside_ior", scene.surface.outside_ior);
  return keys;
}

void TakeObject(const ImportedScene& scene, const Path& file, const Path& folder, CaptureParts& capture) {
  std::vector<std::string> names;
  for (const ImportedLayer& layer : scene.layers) names.push_back(layer.name);
  names = FileNames(names, "surface");  // that name is taken in material files
  for (size_t l = 0; l < names.size(); ++l) {
    const ImportedMesh& surface = scene.layers[l].surface;
    const Path made = folder / ("layer_" + names[l] + ".ply");
    if (surface.unchanged.empty()) WritePly(made, surface.mesh);
    capture.meshes.emplace_back(names[l], surface.unchanged.empty() ? made : surface.unchanged);
    capture.layer_keys.emplace_back(names[l], LayerKeys(scene.layers[l]));
  }
  capture.object_keys = ObjectKeys(scene, file);
}

/// A picture of the map in the object's axes.
Image Turned(const EnvironmentLight& light) {
  constexpr int kWidth = 2048, kHeight = kWidth / 2;
  Image picture(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {  // EnvironmentMap says where directions lie
      const double azimuth = 2 * std::numbers::pi * (0.5 - (x + 0.5) / kWidth),
                   polar = std::numbers::pi * (y + 0.5) / kHeight;
      const glm::dvec3 way(std::sin(polar) * std::sin(azimuth), std::cos(polar), std::sin(polar) * std::cos(azimuth));
      const Spectrum radiance = light.map->Radiance(light.map_from_frame * way);
      for (int c = 0; c < 3; ++c) picture.at(x, y, c) = static_cast<float>(radiance[c]);
    }
  return picture;
}

/// Different lamps of all scenes, as one rig.
class Rig {
 public:
  explicit Rig(const Path& folder) : folder_(folder) {}

  /// The name of the lamp in the rig.
  std::string Take(const ImportedLight& taken) {
    std::string text = ToJsonText(JsonOf(taken, "", ""));
    if (!taken.picture.empty()) {
      const auto& map = std::get<EnvironmentLight>(taken.light.shape);
      text += Sha256OfFile(taken.picture) + ToJsonText(RigidTransformJson({map.map_from_frame, glm::dvec3(0.0)}));
    }
    for (const auto& [known, name] : names_)
      if (known == text) return name;
    std::vector<std::string> all;
    for (const auto& known : names_) all.push_back(known.second);
    all.push_back(taken.light.name);
    names_.emplace_back(text, FileNames(all).back());
    const std::string& name = names_.back().second;
    std::string picture;
    if (!taken.picture.empty()) picture = TakePicture(taken, name);
    lights_.emplace_back(JsonOf(taken, name, picture));
    return name;
  }

  Path Write() const {
    const Path file = folder_ / "light_rig.json";
    WriteTextFile(file, ToJsonText(Object{{"format", "crownfit-light-rig/1"}, {"lights", lights_}}));
    return file;
  }
  bool empty() const { return lights_.empty(); }

 private:
  static Object JsonOf(const ImportedLight& taken, const std::string& name, const std::string& picture) {
    if (const auto* map = std::get_if<EnvironmentLight>(&taken.light.shape))
      return {
          {"name", name}, {"type", "environment"}, {"file", picture}, {"radiance_scale_rgb", SpectrumJson(map->scale)}};
    Light light = taken.light;
    light.name = name;
    return std::get<Object>(LightsJson({light})[0].data);
  }

  std::string TakePicture(const ImportedLight& taken, const std::string& name) const {
    const auto& map = std::get<EnvironmentLight>(taken.light.shape);
    if (map.map_from_frame != glm::dmat3(1.0)) {
      WriteImageFile(folder_ / (name + ".exr"), Turned(map));
      return name + ".exr";
    }
    const std::string picture = name + taken.picture.extension().string();
    std::error_code error;
    std::filesystem::copy_file(taken.picture, folder_ / picture, std::filesystem::copy_options::overwrite_existing,
                               error);
    if (error) throw InputError(folder_ / picture, "", "can't be written: " + error.message());
    return picture;
  }

  Path folder_;
  std::vector<std::pair<std::string, std::string>> names_;  ///< by what the lamp is
  JsonValue::Array lights_;
};

/// Different things of all scenes.
class Things {
 public:
  Things(const Path& folder, std::vector<StatedThing>& scenery) : folder_(folder), scenery_(scenery) {}

  std::string Take(const ImportedThing& taken) {
    for (size_t i = 0; i < known_.size(); ++i)
      if (IsSame(known_[i].mesh, taken.mesh) && known_[i].reflectance == taken.reflectance) return scenery_[i].name;
    std::vector<std::string> all;
    for (const StatedThing& thing : scenery_) all.push_back(thing.name);
    all.push_back(taken.name);
    const std::string name = FileNames(all).back();
    const Path file = folder_ / ("thing_" + name + ".ply");
    WritePly(file, taken.mesh);
    known_.push_back(taken);
    scenery_.push_back({name, file, VectorJson(taken.reflectance), {}});
    return name;
  }

 private:
  Path folder_;
  std::vector<StatedThing>& scenery_;
  std::vector<ImportedThing> known_;
};

}  // namespace

std::vector<SceneView> TakeMitsubaScenes(const std::vector<Path>& files, double mm_per_unit, const Path& folder,
                                         CaptureParts& capture) {
  MakeFolder(folder);
  Rig rig(folder);
  Things things(folder, capture.scenery);
  std::vector<SceneView> views;
  std::optional<ImportedScene> first;
  Path first_file;
  for (const Path& file : files) {
    ImportedScene scene = ReadMitsuba(file, mm_per_unit);
    if (scene.views.empty()) continue;  // a part that others include
    SceneView view;
    for (const ImportedLight& light : scene.lights) view.lights.push_back(rig.Take(light));
    for (const ImportedThing& thing : scene.things) view.things.push_back(things.Take(thing));
    for (const ImportedView& one : scene.views) {
      view.view = one;
      if (scene.views.size() == 1) view.view.photograph = file.stem().string();
      if (view.view.photograph.empty())
        throw InputError(file, "<sensor>", "a sensor of several has no id",
                         "Give each the id that is the name of its photograph.");
      views.push_back(view);
    }
    if (!first) {
      first = std::move(scene), first_file = file;
    } else if (!IsSameObject(*first, scene)) {
      throw InputError(file, "", "shows another object than " + first_file.string(),
                       "All photographs of a capture show one object: import different objects one by one.");
    }
  }
  if (!first)
    throw InputError(files.empty() ? Path() : files[0], "<sensor>", "the scene has no sensor",
                     "Name a scene with the sensor of a photograph.");
  if (capture.meshes.empty() && !first->layers.empty()) TakeObject(*first, first_file, folder, capture);
  if (capture.meshes.empty())
    throw InputError(first_file, "<shape>", "no shape has an interior medium, so none is the object",
                     "State the medium inside of it, or give its mesh by --mesh.");
  if (capture.lights.empty() && rig.empty())
    throw InputError(first_file, "<emitter>", "the scene has no lamps", "Give the lamps by --lights.");
  if (capture.lights.empty()) capture.lights = rig.Write();
  return views;
}

}  // namespace crownfit
