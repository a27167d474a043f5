#include "capture/init_capture.h"

#include <algorithm>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "capture/capture.h"
#include "capture/light_rig.h"
#include "capture/poses.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Object = JsonValue::Object;

/// Copies a file into the capture; returns its name there.
std::string Copied(const Path& from, const Path& folder, const std::string& name) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(from, error))
    throw InputError(from, "", "there is no such file", RemedyOfMissing(from));
  const Path to = folder / name;
  std::filesystem::create_directories(to.parent_path(), error);
  std::filesystem::copy_file(from, to, std::filesystem::copy_options::overwrite_existing, error);
  if (error) throw InputError(to, "", "can't be written: " + error.message());
  return name;
}

/// `channels`: their number, 0: red, green and blue.
Object LayerJson(const std::string& name, size_t channels) {
  // Refractive indices and asymmetries: Zijp 2001; Fried et al. 1995. Starts lie in the middle of the published ranges.
  const bool enamel = name == "enamel", dentine = name == "dentine";
  return {{"name", name},
          {"ior", Object{{"fixed", enamel    ? 1.63
                                   : dentine ? 1.54
                                             : 1.5}}},
          {"g", Object{{"fixed", enamel    ? 0.68
                                 : dentine ? 0.93
                                           : 0.8}}},
          {"reduced_scattering_per_mm", Object{{"initial", 2.0}, {"shared", channels == 1 ? "channels" : "power_law"}}},
          {"absorption_per_mm", Object{{"initial", channels > 0 ? std::vector<double>(channels, enamel ? 0.02 : 0.06)
                                                   : enamel     ? std::vector<double>{0.01, 0.02, 0.05}
                                                                : std::vector<double>{0.03, 0.06, 0.15}}}}};
}

/// Names of the cameras' files, by photograph; equal cameras share one. And the poses.
struct Views {
  std::vector<std::string> camera;
  JsonValue::Array pose;
};

Views ViewsOf(const CaptureParts& parts, const Path& folder) {
  Views views;
  if (parts.views.empty()) {
    const std::vector<StatedPose> poses = ReadPoses(parts.poses);
    const std::string camera =
        parts.known_camera ? "calib/camera.json" : Copied(parts.camera, folder, "calib/camera.json");
    if (parts.known_camera) WriteTextFile(folder / camera, ToJsonText(CameraJson(*parts.known_camera)));
    for (const auto& [name, file] : parts.photographs) {
      views.camera.push_back(camera);
      const JsonValue::Array posed = PosesJson({PoseOf(poses, file, parts.poses)});
      views.pose.push_back(std::get<Object>(posed[0].data)[1].second);
    }
    return views;
  }
  std::vector<Camera> written;
  for (const StatedView& view : parts.views) {
    size_t which = std::find(written.begin(), written.end(), view.camera) - written.begin();
    const std::string name = "calib/camera" + (which == 0 ? "" : "_" + std::to_string(which + 1)) + ".json";
    if (which == written.size()) {
      written.push_back(view.camera);
      WriteTextFile(folder / name, ToJsonText(CameraJson(view.camera)));
    }
    views.camera.push_back(name);
    views.pose.emplace_back(RigidTransformJson(view.camera_from_object));
  }
  return views;
}

void RequireKnown(const std::string& name, const std::vector<std::string>& known, const char* option) {
  if (std::find(known.begin(), known.end(), name) != known.end()) return;
  std::string list;
  for (const auto& k : known) list += (list.empty() ? "" : ", ") + k;
  throw InputError("", option, "'" + name + "' is not known", "Known: " + list + ".");
}

/// The object with the value of every key in `from`.
void Replace(Object& object, const Object& from) {
  for (const auto& [key, value] : from) {
    const auto there = std::find_if(object.begin(), object.end(), [&k = key](const auto& m) { return m.first == k; });
    if (there == object.end())
      object.emplace_back(key, value);
    else
      there->second = value;
  }
}

Object ObjectJson(const CaptureParts& parts, const Path& folder) {
  JsonValue::Array layers;
  std::vector<std::pair<std::string, std::optional<Path>>> all;
  for (const auto& [name, file] : parts.meshes) all.emplace_back(name, file);
  for (const auto& name : parts.more_layers) all.emplace_back(name, std::nullopt);
  for (size_t i = 0; i < all.size(); ++i) {
    Object layer = LayerJson(all[i].first, parts.channels.size());
    for (const auto& [name, keys] : parts.layer_keys)
      if (name == all[i].first) Replace(layer, keys);
    if (all[i].second)
      layer.insert(
          layer.begin() + 1,
          {"surface", Copied(*all[i].second, folder, "mesh/" + all[i].first + all[i].second->extension().string())});
    if (i + 1 < all.size() && !all[i + 1].second)
      layer.emplace_back("thickness_mm", Object{{"fixed", parts.thickness_mm}});
    layers.emplace_back(layer);
  }
  Object object{{"layers", layers}, {"surface", Object{{"roughness", Object{{"initial", 0.2}}}}}};
  JsonValue::Array scenery;
  for (const StatedThing& thing : parts.scenery)
    scenery.emplace_back(
        Object{{"name", thing.name},
               {"mesh", Copied(thing.mesh, folder, "mesh/thing_" + thing.name + thing.mesh.extension().string())},
               {"reflectance_rgb", thing.reflectance}});
  if (!scenery.empty()) object.emplace_back("scenery", scenery);
  Replace(object, parts.object_keys);
  return object;
}

}  // namespace

void InitCapture(const CaptureParts& parts, const Path& folder) {
  if (parts.meshes.empty())
    throw InputError("", "--mesh", "the surface of the outermost layer is needed, such as enamel=crown.stl");
  if (parts.photographs.empty())
    throw InputError("", "--photo", "at least one photograph is needed, such as front=front.dng");
  std::vector<std::string> photographs, lights;
  std::vector<Path> files;
  for (const auto& [name, file] : parts.photographs) {
    photographs.push_back(name);
    files.push_back(file);
  }
  RequireDistinctNames(files);
  const LightRig stated_rig = ReadLightRig(parts.lights);
  for (const Light& light : stated_rig.lights) lights.push_back(light.name);
  for (const auto& [name, on] : parts.lit) {
    RequireKnown(name, photographs, "--lit");
    for (const auto& light : on) RequireKnown(light, lights, "--lit");
  }
  for (const auto& [name, filter] : parts.polarisation) {
    RequireKnown(name, photographs, "--polarisation");
    RequireKnown(filter, {"none", "cross", "parallel"}, "--polarisation");
  }
  for (const auto& [name, file] : parts.masks) RequireKnown(name, photographs, "--mask");
  for (const auto& [name, file] : parts.variances) RequireKnown(name, photographs, "variance");
  for (const auto& name : parts.holdouts) RequireKnown(name, photographs, "--holdout");

  const Object object = ObjectJson(parts, folder);
  const std::string rig = Copied(parts.lights, folder, "calib/light_rig.json");
  const Views views = ViewsOf(parts, folder);
  for (const Path& picture : stated_rig.files) {  // environment maps lie beside their rig
    const Path beside = picture.lexically_relative(parts.lights.parent_path());
    if (picture == parts.lights || beside.empty()) continue;
    if (*beside.begin() == "..")
      throw InputError(parts.lights, "lights", "names " + picture.string() + ", which is not in the rig's own folder",
                       "Put the picture into the folder of the rig, and name it without a path.");
    Copied(picture, folder, (Path("calib") / beside).string());
  }
  Object side;
  if (parts.noise) side.emplace_back("noise", Copied(*parts.noise, folder, "calib/noise.json"));
  if (parts.colour) side.emplace_back("colour", Copied(*parts.colour, folder, "calib/colour.json"));
  if (parts.blur) side.emplace_back("blur", Copied(*parts.blur, folder, "calib/blur.json"));

  JsonValue::Array photos;
  for (size_t p = 0; p < parts.photographs.size(); ++p) {
    const auto& [name, file] = parts.photographs[p];
    const auto find = [&, &of = name](const auto& list) {
      return std::find_if(list.begin(), list.end(), [&](const auto& item) { return item.first == of; });
    };
    const auto on = find(parts.lit);
    const auto filter = find(parts.polarisation);
    const auto mask = find(parts.masks);
    Object photo{{"name", name},
                 {"file", Copied(file, folder, "photos/" + name + file.extension().string())},
                 {"camera", views.camera[p]},
                 {"camera_from_object", views.pose[p]},
                 {"lights", on == parts.lit.end() ? lights : on->second}};
    std::vector<std::string> beside;
    for (const StatedThing& thing : parts.scenery)
      if (std::find(thing.photographs.begin(), thing.photographs.end(), name) != thing.photographs.end())
        beside.push_back(thing.name);
    if (!beside.empty()) photo.emplace_back("scenery", beside);
    if (filter != parts.polarisation.end()) photo.emplace_back("polarisation", filter->second);
    if (mask != parts.masks.end())
      photo.emplace_back("mask",
                         Copied(mask->second, folder, "photos/" + name + "_mask" + mask->second.extension().string()));
    if (const auto variance = find(parts.variances); variance != parts.variances.end())
      photo.emplace_back("variance", Copied(variance->second, folder, "photos/" + name + "_variance.exr"));
    photo.insert(photo.end(), side.begin(), side.end());
    photo.emplace_back("exposure_scale", Object{{parts.exposure_is_free ? "initial" : "fixed", 1.0}});
    if (std::find(parts.holdouts.begin(), parts.holdouts.end(), name) != parts.holdouts.end())
      photo.emplace_back("use", "holdout");
    photos.emplace_back(photo);
  }
  Object content{{"format", "crownfit-capture/1"}, {"object", object}};
  if (!parts.channels.empty()) {
    JsonValue::Array channels;
    for (const auto& [name, nm] : parts.channels) channels.push_back(Object{{"name", name}, {"wavelength_nm", nm}});
    content.emplace_back("channels", channels);
  }
  content.emplace_back("light_rig", rig);
  content.emplace_back("photographs", photos);
  WriteTextFile(folder / "capture.json", ToJsonText(content));
}

}  // namespace crownfit
