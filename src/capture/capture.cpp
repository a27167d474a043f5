#include "capture/capture.h"

#include <algorithm>
#include <set>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/text.h"
#include "capture/colour_file.h"
#include "capture/poses.h"
#include "photo/observer.h"

namespace crownfit {
namespace {

// Far above what real captures need, far below files that only list names.
constexpr size_t kMostLights = 256, kMostThings = 10000, kMostMeasurements = 300;
constexpr double kMostMemoryEvents = 1e6;
constexpr double kSmallestTile_mm = 1e-3;

/// Index of the item called `name`; otherwise throws InputError for the key.
template <class Item>
size_t IndexOf(const std::vector<Item>& items, const std::string& name, const JsonNode& node, const char* what) {
  std::string known;
  for (size_t i = 0; i < items.size(); ++i) {
    if (items[i].name == name) return i;
    known += (known.empty() ? "" : ", ") + items[i].name;
  }
  node.Fail("there is no " + std::string(what) + " called '" + name + "'",
            known.empty() ? "The capture defines none." : "Known: " + known + ".");
}

/// {"zones": [cervical, middle, incisal]} or {"vertex_property": name}; nothing when the thickness is a number.
std::optional<ThicknessField> ReadThicknessField(const JsonObject& layer) {
  const auto node = layer.Find(RowOf(Quantity::kThickness).key);
  if (!node || !node->IsObject()) return std::nullopt;
  const JsonObject object(*node, {"fixed", "initial", "bounds", "prior", "shared", "zones", "vertex_property"});
  const auto zones = object.Find("zones"), property = object.Find("vertex_property");
  if (!zones && !property) return std::nullopt;
  if (node->Members().size() != 1)
    node->Fail("\"zones\" or \"vertex_property\" must be the only key of a thickness",
               "To fit the thickness, free \"thickness_scale\", which multiplies it.");
  ThicknessField field;
  if (property) field.vertex_property = property->String();
  if (zones) {
    const auto values = zones->Numbers(3);
    for (size_t k = 0; k < 3; ++k) {
      if (!(values[k] >= 0 && values[k] <= RowOf(Quantity::kThickness).high))
        zones->Fail("a thickness must lie in [0, 20] mm");
      field.zones_mm[k] = values[k];
    }
  }
  return field;
}

JunctionNoise ReadJunctionNoise(const JsonNode& node) {
  const JsonObject object(node, {"amplitude_mm", "wavelength_mm", "seed"});
  JunctionNoise noise;
  noise.amplitude_mm = object.Require("amplitude_mm").Number(0.0, 2.0);
  noise.wavelength_mm = object.Require("wavelength_mm").Number(0.2, 100.0);
  if (const auto seed = object.Find("seed")) noise.seed = static_cast<uint64_t>(seed->Number(0.0, 1e15));
  return noise;
}

void ReadParameters(const JsonObject& object, Owner owner, int channels, bool thickness_is_field,
                    std::array<ParameterSpec, kParameters.size()>& out) {
  for (size_t i = 0; i < kParameters.size(); ++i) {
    const ParameterRow& row = kParameters[i];
    out[i] = DefaultSpec(row, channels);
    if (row.owner != owner || (row.quantity == Quantity::kThickness && thickness_is_field)) continue;
    if (const auto node = object.Find(row.key)) out[i] = ReadParameterSpec(*node, row, channels);
  }
}

std::filesystem::path ReadPath(const JsonNode& node, Capture& capture) {
  const std::string text = node.String();
  if (text.empty()) node.Fail("the path is empty");
  capture.input_files.push_back(capture.folder / text);
  return capture.input_files.back();
}

AbsorptionTextureSpec ReadAbsorptionTexture(const JsonNode& node, Capture& capture) {
  const JsonObject object(node, {"file", "vertex_property", "range"});
  const auto file = object.Find("file"), property = object.Find("vertex_property");
  if (file.has_value() == property.has_value())
    node.Fail("expected either \"file\": a picture, or \"vertex_property\": a name, or one name per channel");
  AbsorptionTextureSpec texture;
  if (file) texture.file = ReadPath(*file, capture);
  if (property && property->IsArray()) {
    for (const auto& name : property->Items()) texture.vertex_properties.push_back(name.String());
    if (texture.vertex_properties.size() != capture.channel_names.size())
      property->Fail("expected one name, or one name per channel");
  } else if (property) {
    texture.vertex_properties = {property->String()};
  }
  if (const auto range = object.Find("range")) {
    const auto values = range->Numbers(2);
    if (!(values[0] >= 0 && values[1] >= 0)) range->Fail("factors on absorption can't be negative");
    texture.low = values[0], texture.high = values[1];
  }
  return texture;
}

/// `has_shape`: there are photographs, so the object needs meshes.
void ReadObject(const JsonNode& node, bool has_shape, Capture& capture) {
  const JsonObject object(node, {"layers", "surface", "scenery", "backings", "outside_ior", "neck", "long_axis"});
  const JsonNode layers = object.Require("layers");
  std::vector<std::string> layer_keys = ParameterKeys(Owner::kLayer);
  layer_keys.insert(layer_keys.end(), {"name", "surface", "junction_noise", "absorption_texture"});
  for (const auto& item : layers.Items(kMostLayers)) {
    const JsonObject layer(item, layer_keys);
    LayerSpec spec;
    spec.name = layer.Require("name").Name();
    if (spec.name == "surface")
      layer.Require("name").Fail("a layer can't be called \"surface\", which names the parameters of the outer surface",
                                 "Choose another name.");
    for (const auto& other : capture.layers)
      if (other.name == spec.name) layer.Require("name").Fail("two layers are called '" + spec.name + "'");
    if (const auto surface = layer.Find("surface")) spec.surface = ReadPath(*surface, capture);
    if (has_shape && capture.layers.empty()) layer.Require("surface");
    spec.thickness_field = ReadThicknessField(layer);
    if (const auto noise = layer.Find("junction_noise")) spec.junction_noise = ReadJunctionNoise(*noise);
    if (const auto texture = layer.Find("absorption_texture"))
      spec.absorption_texture = ReadAbsorptionTexture(*texture, capture);
    ReadParameters(layer, Owner::kLayer, capture.channels(), spec.thickness_field.has_value(), spec.parameters);
    capture.layers.push_back(spec);
  }
  if (capture.layers.empty()) layers.Fail("at least one layer is needed", "Outermost first: enamel, then dentine.");
  for (size_t i = 0; i + 1 < capture.layers.size(); ++i) {
    const LayerSpec& layer = capture.layers[i];
    const JsonNode where = layers.Items()[i];
    const JsonObject keys(where, layer_keys);
    if (capture.layers[i + 1].surface && layer[Quantity::kThickness].stated && !layer[Quantity::kThickness].fixed)
      keys.Require("thickness_mm")
          .Fail("the next layer has a surface of its own, which sets the thickness", "Free thickness_scale instead.");
    if (capture.layers[i + 1].surface && (layer.thickness_field || layer.junction_noise.amplitude_mm > 0))
      keys.Require(layer.thickness_field ? "thickness_mm" : "junction_noise")
          .Fail("the next layer has a surface of its own, which sets the thickness",
                "Remove this key, or the surface of the next layer.");
    if (!capture.layers[i + 1].surface && layer[Quantity::kThicknessScale].stated && !layer.thickness_field)
      keys.Require("thickness_scale").Fail("the next layer has no surface of its own", "State thickness_mm instead.");
    if (has_shape && !capture.layers[i + 1].surface && !layer[Quantity::kThickness].stated && !layer.thickness_field)
      throw InputError(capture.file, where.key() + ".thickness_mm", "this required key is missing",
                       "The next layer has no surface of its own, so this thickness defines it.");
  }

  const LayerSpec& last = capture.layers.back();
  if (last.thickness_field || last.junction_noise.amplitude_mm > 0)
    layers.Items().back().Fail("the last layer has no junction below it",
                               "Remove it: zones, vertex properties and noise shape the next layer.");

  JsonValue empty{JsonValue::Object()};
  const JsonNode nothing(&empty, &capture.file, "object.surface");
  ReadParameters(JsonObject(object.Find("surface").value_or(nothing), ParameterKeys(Owner::kSurface)), Owner::kSurface,
                 capture.channels(), false, capture.surface);
  if (const auto scenery = object.Find("scenery")) {
    for (const auto& item : scenery->Items(kMostThings)) {
      const JsonObject o(item, {"name", "mesh", "reflectance_rgb"});
      ScenerySpec spec{o.Require("name").Name(), ReadPath(o.Require("mesh"), capture),
                       Spectrum(capture.channels(), 0.0)};
      if (const auto rho = o.Find("reflectance_rgb")) spec.reflectance = ReadSpectrum(*rho, 1.0, capture.channels());
      for (const auto& other : capture.scenery)
        if (other.name == spec.name) o.Require("name").Fail("two things are called '" + spec.name + "'");
      capture.scenery.push_back(spec);
    }
  }
  if (const auto backings = object.Find("backings")) {
    for (const auto& [name, item] : backings->Members()) {
      const JsonObject o(item, {"point_mm", "normal", "size_mm", "reflectance_rgb", "contact"});
      BackingSpec spec;
      spec.name = name;
      spec.has_place = o.Find("point_mm") || o.Find("normal");
      if (spec.has_place) {
        spec.point_mm = ReadPlace(o.Require("point_mm"));
        spec.normal = ReadUnitVector(o.Require("normal"));
      }
      if (const auto size = o.Find("size_mm")) spec.size_mm = size->Number(kSmallestTile_mm, kFarthestPlace_mm);
      spec.reflectance = ReadSpectrum(o.Require("reflectance_rgb"), 1.0, capture.channels());
      if (const auto contact = o.Find("contact")) spec.in_contact = contact->Bool();
      capture.backings.push_back(spec);
    }
  }
  if (const auto ior = object.Find("outside_ior")) capture.outside_ior = ior->Number(1.0, 2.0);
  if (const auto axis = object.Find("long_axis")) capture.long_axis = ReadUnitVector(*axis);
  if (const auto neck = object.Find("neck")) {
    const std::string word = neck->OneOf({"air", "absorbing", "root"});
    if (word != "root" && capture.surface[static_cast<size_t>(Quantity::kNeckReturn)].stated)
      neck->Fail("surface.neck_return needs the neck \"root\"", "Write \"root\", or remove neck_return.");
    capture.neck = word == "air" ? Neck::kAir : word == "absorbing" ? Neck::kAbsorbing : Neck::kRoot;
  }
}

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
  for (const std::string& name : capture.channel_names)
    files.planes.push_back(ReadPath(named.Require(name), capture));
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

std::vector<std::string> ChannelsInFile(const Capture& capture) {
  return capture.channels() == 3 ? std::vector<std::string>{"R", "G", "B"} : capture.channel_names;
}

Quantity ThicknessQuantity(const Capture& capture, size_t layer) {
  const bool next_has_mesh = layer + 1 < capture.layers.size() && capture.layers[layer + 1].surface;
  return next_has_mesh || capture.layers[layer].thickness_field ? Quantity::kThicknessScale : Quantity::kThickness;
}

void RequirePhotographs(const Capture& capture) {
  if (capture.photographs.empty())
    throw InputError(capture.file, "photographs", "the capture has measurements alone, so there is no shape to show",
                     "Use crownfit fit or check with it, and crownfit predict or export with the result.");
}

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
