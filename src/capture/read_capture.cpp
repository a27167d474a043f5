#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/text.h"
#include "capture/capture.h"
#include "capture/colour_file.h"
#include "capture/poses.h"
#include "capture/read_object.h"
#include "photo/observer.h"

namespace crownfit {
namespace {

// Far above what real captures need, far below files that only list names.
constexpr size_t kMostLights = 256, kMostMeasurements = 300;
constexpr double kMostMemoryEvents = 1e6;

Encoding ReadEncoding(const JsonNode& node) {
  if (node.IsObject()) return {Encoding::Kind::kGamma, JsonObject(node, {"gamma"}).Require("gamma").Number(0.2, 5.0)};
  const std::string word = node.OneOf({"file", "linear", "srgb"});
  return {word == "linear" ? Encoding::Kind::kLinear
          : word == "srgb" ? Encoding::Kind::kSrgb
                           : Encoding::Kind::kFile,
          1.0};
}

/// "file": one picture with all channels; or "files": one picture per channel, by its name.
void ReadPhotographFiles(const JsonObject& o, Capture& capture, PhotographFiles& files) {
  files.channel_names = capture.channel_names;
  const auto per_channel = o.Find("files");
  if (!per_channel) {
    files.image = ReadPath(o.Require("file"), capture);
    return;
  }
  if (const auto file = o.Find("file")) file->Fail("\"file\" and \"files\" exclude each other", "Keep one of them.");
  const JsonObject named(*per_channel, capture.channel_names);
  for (const std::string& name : capture.channel_names) files.planes.push_back(ReadPath(named.Require(name), capture));
  files.image = files.planes[0];
}

PhotographSpec ReadPhotographSpec(const JsonNode& node, Capture& capture) {
  const JsonObject o(node, {"name",
                            "file",
                            "files",
                            "camera",
                            "camera_from_object",
                            "lights",
                            "polarisation",
                            "polarisation_memory_events",
                            "backing",
                            "scenery",
                            "mask",
                            "colour",
                            "noise",
                            "blur",
                            "variance",
                            "saturation",
                            "encoding",
                            "exposure_scale",
                            "exposure_group",
                            "use"});
  PhotographSpec photo;
  photo.key = node.key();
  photo.name = o.Require("name").Name();
  for (const auto& other : capture.photographs)
    if (other.name == photo.name) o.Require("name").Fail("two photographs are called '" + photo.name + "'");
  if (photo.name.find('/') != std::string::npos || photo.name[0] == '.')
    o.Require("name").Fail("a photograph's name becomes a file name: it can't contain '/' or begin with '.'");
  ReadPhotographFiles(o, capture, photo.files);
  photo.camera_file = ReadPath(o.Require("camera"), capture);
  photo.camera = ReadCamera(photo.camera_file);
  const JsonNode pose = o.Require("camera_from_object");
  photo.camera_from_object = ReadRigidTransform(pose);
  if (glm::length(photo.camera_from_object.translation_mm) > kFarthestPlace_mm)
    pose.Fail("photograph '" + photo.name + "' was taken from more than 100 m", "Give translation_mm in mm.");
  photo.pose_covariance = ReadPoseCovariance(pose);
  const auto lights = o.Require("lights").Items();
  if (lights.size() > kMostLights)
    o.Require("lights").Fail(std::to_string(lights.size()) + " lights are more than " + std::to_string(kMostLights),
                             "Combine small lamps into one: a ring, a rectangle or an environment map.");
  for (const auto& light : lights) {
    photo.lights.push_back(IndexOf(capture.lights, light.String(), light, "light"));
    if (std::count(photo.lights.begin(), photo.lights.end(), photo.lights.back()) > 1)
      light.Fail("light '" + light.String() + "' is listed twice",
                 "List it once. To make it brighter, scale it in the light rig.");
  }
  if (const auto p = o.Find("polarisation")) {
    const std::string word = p->OneOf({"none", "cross", "parallel"});
    photo.polarisation = word == "none"    ? Polarisation::kNone
                         : word == "cross" ? Polarisation::kCross
                                           : Polarisation::kParallel;
  }
  if (const auto memory = o.Find("polarisation_memory_events"))
    photo.polarisation_memory_events = memory->Number(0.0, kMostMemoryEvents);
  if (const auto backing = o.Find("backing"); backing && backing->String() != "none")
    photo.backing = IndexOf(capture.backings, backing->String(), *backing, "backing");
  if (photo.backing && !capture.backings[*photo.backing].has_place)
    o.Require("backing").Fail("this backing has no position", "State its point_mm and normal in object.backings.");
  if (const auto scenery = o.Find("scenery"))
    for (const auto& thing : scenery->Items(kMostThings))
      photo.scenery.push_back(IndexOf(capture.scenery, thing.String(), thing, "piece of scenery"));
  if (const auto mask = o.Find("mask")) photo.files.mask = ReadPath(*mask, capture);
  if (const auto variance = o.Find("variance")) photo.files.variance = ReadPath(*variance, capture);
  if (const auto encoding = o.Find("encoding")) photo.files.encoding = ReadEncoding(*encoding);
  if (const auto saturation = o.Find("saturation")) {
    photo.files.saturation = saturation->Positive();
    photo.files.saturation_key = saturation->key();
  }
  photo.rgb_from_sensor = ColourOfChannels(capture.wavelengths_nm);
  if (const auto colour = o.Find("colour")) {
    photo.rgb_from_sensor = ReadColourTransform(ReadPath(*colour, capture), capture.channels());
    photo.has_colour_file = true;
  }
  if (const auto noise = o.Find("noise")) {
    photo.files.noise = ReadSensorNoise(ReadPath(*noise, capture), capture.channels());
    photo.has_noise_file = true;
  }
  if (const auto blur = o.Find("blur")) photo.blur = ReadBlur(ReadPath(*blur, capture));
  if (const auto scale = o.Find("exposure_scale")) {
    const Factor factor = ReadFactor(*scale);
    photo.exposure_scale = factor.value, photo.exposure_stddev = factor.stddev;
    photo.exposure_is_free = factor.is_free;
  }
  photo.exposure_group = photo.name;
  if (const auto group = o.Find("exposure_group")) photo.exposure_group = "group " + group->String();
  if (const auto use = o.Find("use")) photo.is_holdout = use->OneOf({"fit", "holdout"}) == "holdout";
  return photo;
}

void ReadMeasurements(const JsonNode& node, Capture& capture) {
  const MeasurementContext context{
      capture.layers.size(), capture.wavelengths_nm,
      [&](const JsonNode& name) { return IndexOf(capture.backings, name.String(), name, "backing"); },
      [&](const JsonNode& file) { return ReadPath(file, capture); }};
  for (const auto& item : node.Items(kMostMeasurements)) {
    const FlatMeasurement m = ReadFlatMeasurement(item, context);
    for (const auto& other : capture.measurements)
      if (other.name == m.name) {
        item.Fail("two measurements are called '" + m.name + "'");
      } else if (!m.sample.empty() && other.sample == m.sample &&
                 (other.thickness_mm != m.thickness_mm || other.thickness_stddev_mm != m.thickness_stddev_mm)) {
        item.Fail("'" + m.name + "' and '" + other.name + "' are of one sample but state different thicknesses",
                  "State the same thickness_mm and thickness_stddev_mm, or name two samples.");
      }
    capture.measurements.push_back(m);
  }
  if (std::all_of(capture.measurements.begin(), capture.measurements.end(),
                  [](const FlatMeasurement& m) { return m.is_holdout; }))
    node.Fail("there is no measurement to fit", "List at least one measurement without \"use\": \"holdout\".");
}

void ReadChannels(const JsonNode& node, Capture& capture) {
  const auto items = node.Items();
  if (items.empty() || items.size() > kMostChannels)
    node.Fail(Printed("a capture has 1 to %d channels, found %zu", kMostChannels, items.size()));
  capture.channel_names.clear();
  capture.wavelengths_nm.clear();
  for (const JsonNode& item : items) {
    const JsonObject channel(item, {"name", "wavelength_nm"});
    const std::string name = channel.Require("name").Name();
    if (std::count(capture.channel_names.begin(), capture.channel_names.end(), name))
      channel.Require("name").Fail("an earlier channel has this name",
                                   "Give each channel a name of its own: results are listed by name.");
    capture.channel_names.push_back(name);
    capture.wavelengths_nm.push_back(channel.Require("wavelength_nm").Number(200.0, 2500.0));
  }
}

Capture ReadAs(const std::string& format, const std::filesystem::path& path, std::vector<std::string> keys) {
  Capture capture;
  capture.file = path;
  capture.folder = capture.file.has_parent_path() ? capture.file.parent_path() : std::filesystem::path(".");
  capture.input_files.push_back(capture.file);
  const JsonFile file(capture.file);
  keys.insert(keys.end(), {"object", "channels", "light_rig", "photographs"});
  const JsonObject root = file.RootOfFormat(format, keys);
  const auto measurements = root.Find("measurements");
  const bool has_photographs = !measurements || root.Find("photographs");
  if (const auto channels = root.Find("channels")) ReadChannels(*channels, capture);
  ReadObject(root.Require("object"), has_photographs, capture);
  if (has_photographs) {
    LightRig rig = ReadLightRig(ReadPath(root.Require("light_rig"), capture), capture.channel_names);
    capture.lights = std::move(rig.lights);
    capture.input_files.insert(capture.input_files.end(), rig.files.begin(), rig.files.end());
    const JsonNode photographs = root.Require("photographs");
    for (const auto& item : photographs.Items(kMostThings))
      capture.photographs.push_back(ReadPhotographSpec(item, capture));
    if (capture.photographs.empty()) photographs.Fail("at least one photograph is needed");
  }
  if (measurements) ReadMeasurements(*measurements, capture);
  std::sort(capture.input_files.begin(), capture.input_files.end());
  capture.input_files.erase(std::unique(capture.input_files.begin(), capture.input_files.end()),
                            capture.input_files.end());
  return capture;
}

}  // namespace

Capture ReadCapture(const std::filesystem::path& path) {
  std::error_code ignored;
  const auto file = std::filesystem::is_regular_file(path, ignored) ? path : path / "capture.json";
  if (!std::filesystem::is_regular_file(file, ignored))
    throw InputError(file, "", "there is no capture here",
                     RemedyOfMissing(file, "Give a folder that holds capture.json, or that file."));
  return ReadAs("crownfit-capture/1", file, {"measurements"});
}

Capture ReadRecipeCapture(const std::filesystem::path& file) {
  return ReadAs("crownfit-recipe/1", file, {"synthesis"});
}

}  // namespace crownfit
