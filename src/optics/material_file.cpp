#include "optics/material_file.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/json_file.h"
#include "base/text.h"
#include "capture/capture.h"
#include "photo/colour.h"

namespace crownfit {
namespace {

const char* const kFormat = "crownfit-material/1";

JsonObject RootOf(const JsonFile& file) {
  return file.RootOfFormat(
      kFormat, {"model", "status", "reasons", "caveats", "channels", "layers", "surface", "viewer", "image_error",
                "measurements", "identifiability", "joint", "linear_scales", "linear_scales_stddev", "calibration",
                "scenery_levels", "provenance", "captures"});
}

std::vector<std::string> LayerKeys() {
  std::vector<std::string> keys = ParameterKeys(Owner::kLayer);
  keys.emplace_back("name");
  return keys;
}

/// The layers with their names, outermost first.
std::vector<std::pair<std::string, JsonObject>> ReadLayers(const JsonNode& node) {
  std::vector<std::pair<std::string, JsonObject>> layers;
  for (const auto& item : node.Items(kMostLayers)) {
    const JsonObject object(item, LayerKeys());
    const std::string name = object.Require("name").Name();
    for (const auto& other : layers)
      if (other.first == name)
        object.Require("name").Fail("two layers are called '" + name + "'", "Remove one, or rename it.");
    layers.emplace_back(name, object);
  }
  return layers;
}

/// An end that is not known is null.
std::optional<std::array<double, 2>> ReadInterval(const JsonNode& node) {
  const auto ends = node.Items();
  if (ends.size() != 2) node.Fail("expected the two ends of an interval");
  if (!ends[0].IsNumber() || !ends[1].IsNumber()) return std::nullopt;
  return std::array{ends[0].Number(), ends[1].Number()};
}

ParameterRecord ReadRecord(const JsonObject& object, size_t channels) {
  ParameterRecord record;
  if (const auto stddev = object.Find("stddev")) {
    const auto items = stddev->IsArray() ? stddev->Items() : std::vector<JsonNode>{*stddev};
    if (items.size() != 1 && items.size() != channels) stddev->Fail("expected one number, or one per channel");
    for (const JsonNode& item : items)
      record.stddev.push_back(item.IsNumber() ? std::optional(item.Number()) : std::nullopt);
  }
  if (const auto status = object.Find("status")) record.status = status->String();
  if (const auto node = object.Find("status_by_channel")) {
    for (const auto& item : node->Items()) record.status_by_channel.push_back(item.String());
    if (record.status_by_channel.size() != channels) node->Fail("expected a status per channel");
  }
  if (const auto node = object.Find("interval95")) {
    const auto items = node->Items();
    if (std::none_of(items.begin(), items.end(), [](const JsonNode& item) { return item.IsArray(); })) {
      record.interval95.push_back(ReadInterval(*node));
    } else {
      for (const auto& item : items) record.interval95.push_back(ReadInterval(item));
      if (items.size() != channels) node->Fail("expected one interval, or one per channel");
    }
  }
  return record;
}

/// A bare value, a list with one per channel, or an object that holds either as "value".
Spectrum ReadValues(JsonNode node, const ParameterRow& row, int channels, ParameterRecord& record) {
  if (node.IsObject()) {
    const JsonObject object(node, {"value", "stddev", "interval95", "status", "status_by_channel"});
    record = ReadRecord(object, static_cast<size_t>(channels));
    node = object.Require("value");
  }
  record.is_stated = true;
  return ReadPhysicalValues(node, row, channels);
}

void ReadOwner(const JsonObject& object, Owner owner, Material::Layer& out, MaterialRecord::Owner& records) {
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].owner == owner)
      if (const auto node = object.Find(kParameters[i].key))
        out.values[i] = ReadValues(*node, kParameters[i], out.values[i].size(), records[i]);
}

/// The material with the values of the block "viewer" in place of its own.
Material ReadViewer(const JsonNode& node, Material material) {
  const JsonObject viewer(node, {"note", "layers", "roughness", "matched"});
  MaterialRecord::Owner ignored;
  for (const auto& [name, object] : ReadLayers(viewer.Require("layers")))
    for (auto& layer : material.layers)
      if (layer.name == name) ReadOwner(object, Owner::kLayer, layer, ignored);
  if (const auto roughness = viewer.Find("roughness"))
    material.surface[Quantity::kRoughness] =
        ReadPhysicalValues(*roughness, RowOf(Quantity::kRoughness), material.channels());
  return material;
}

/// Names and wavelengths, where the file states its channels.
void ReadChannels(const JsonObject& root, MaterialOutline& outline) {
  const auto channels = root.Find("channels");
  if (!channels) return;
  const auto items = channels->Items();
  if (items.empty() || items.size() > kMostChannels)
    channels->Fail(Printed("expected 1 to %d channels", kMostChannels));
  outline.channel_names.emplace();
  outline.wavelengths_nm.emplace();
  for (const JsonNode& item : items) {
    const JsonObject channel(item, {"name", "wavelength_nm"});
    outline.channel_names->push_back(channel.Require("name").String());
    outline.wavelengths_nm->push_back(channel.Require("wavelength_nm").Number(200.0, 2500.0));
  }
}

/// Values are matched by position: those of another band would be taken for this one.
void CheckSameBands(const JsonObject& material, const std::vector<double>& its_nm, const Capture& capture) {
  if (AreSameBands(its_nm, capture.wavelengths_nm)) return;
  material.Require("channels")
      .Fail(
          "its bands are " + BandsText(its_nm) + ", but those of " + capture.file.string() + " are " +
              BandsText(capture.wavelengths_nm),
          "Give a material of these bands in this order. To use it all the same, write these bands into its channels.");
}

JsonValue FixedValue(const Spectrum& values, const ParameterRow& row) {
  const JsonValue value = row.per_channel ? JsonValue(std::vector<double>(values.begin(), values.end())) : values[0];
  return JsonValue::Object{{"value", value}, {"status", "fixed"}};
}

}  // namespace

bool IsOfLayer(const Capture& capture, size_t layer, const ParameterRow& row) {
  const LayerSpec& spec = capture.layers[layer];
  const bool is_last = layer + 1 == capture.layers.size();
  if (row.owner != Owner::kLayer) return false;
  if (row.quantity == Quantity::kThickness)
    return is_last ? spec[Quantity::kThickness].stated : ThicknessQuantity(capture, layer) == Quantity::kThickness;
  return row.quantity != Quantity::kThicknessScale || spec[Quantity::kThicknessScale].stated ||
         (!is_last && ThicknessQuantity(capture, layer) == Quantity::kThicknessScale);
}

MaterialRecord ReadMaterialRecord(const std::filesystem::path& path, const Capture& capture) {
  const JsonFile file(path);
  const JsonObject root = RootOf(file);
  MaterialRecord record;
  record.material = StatedMaterial(capture);
  MaterialOutline outline;
  ReadChannels(root, outline);
  record.channel_names = outline.channel_names;
  record.wavelengths_nm = outline.wavelengths_nm;
  if (outline.wavelengths_nm) CheckSameBands(root, *outline.wavelengths_nm, capture);
  if (const auto status = root.Find("status")) record.is_usable = status->String() != "not_usable";
  const auto layers = ReadLayers(root.Require("layers"));
  for (auto& layer : record.material.layers) {
    record.layers.emplace_back();
    const auto found = std::find_if(layers.begin(), layers.end(), [&](const auto& l) { return l.first == layer.name; });
    if (found == layers.end())
      root.Require("layers").Fail("has no layer called '" + layer.name + "', but the capture has one",
                                  "Give the material that was fitted to this capture, or use the same layer names.");
    ReadOwner(found->second, Owner::kLayer, layer, record.layers.back());
  }
  if (const auto surface = root.Find("surface"))
    ReadOwner(JsonObject(*surface, ParameterKeys(Owner::kSurface)), Owner::kSurface, record.material.surface,
              record.surface);
  if (const auto joint = root.Find("joint"))
    record.joint = ReadJointValues(*joint, record.material, outline.channel_names.value_or(capture.channel_names));
  if (const auto viewer = root.Find("viewer")) record.effective = ReadViewer(*viewer, record.material);
  if (const auto scales = root.Find("linear_scales"))
    for (const auto& [name, node] : scales->Members()) record.linear_scales[name] = node.Positive();
  return record;
}

MaterialRecord ReadMaterialRecord(const std::filesystem::path& path) {
  return ReadMaterialRecord(path, CaptureOfOutline(ReadMaterialOutline(path), path));
}

Material ReadMaterialFile(const std::filesystem::path& file, const Capture& capture) {
  return ReadMaterialRecord(file, capture).material;
}

std::string EffectiveNote(const MaterialRecord& record) {
  if (!record.effective) return "";
  double largest = 0;
  std::string where;
  for (size_t l = 0; l < record.material.layers.size(); ++l)
    for (const ParameterRow& row : kParameters)
      for (int c = 0; c < record.material.channels(); ++c) {
        const double own = record.material.layers[l][row.quantity][c],
                     off = record.effective->layers[l][row.quantity][c] - own;
        if (own == 0 || std::abs(off) <= largest * std::abs(own)) continue;
        largest = std::abs(off / own);
        where = record.material.layers[l].name + "." + row.key;
      }
  if (where.empty()) return "";
  return Printed("effective parameters, up to %.0f %% off the physical ones (%s). --physical shows those",
                 100 * largest, where.c_str());
}

Capture WithLinearScales(Capture capture, const std::map<std::string, double>& linear_scales) {
  const auto apply = [&](const std::string& name, double& scale) {
    if (const auto found = linear_scales.find(name); found != linear_scales.end()) scale = found->second;
  };
  for (PhotographSpec& photo : capture.photographs) apply("exposure_scale " + photo.name, photo.exposure_scale);
  for (Light& light : capture.lights) apply("intensity_scale " + light.name, light.intensity_scale);
  return capture;
}

MaterialOutline ReadMaterialOutline(const std::filesystem::path& path) {
  const JsonFile file(path);
  const JsonObject root = RootOf(file);
  MaterialOutline outline;
  const JsonNode layers = root.Require("layers");
  for (const auto& layer : ReadLayers(layers)) outline.layers.push_back(layer.first);
  if (outline.layers.empty()) layers.Fail("has no layer", "State at least one.");
  if (const auto status = root.Find("status")) outline.status = status->String();
  if (const auto reasons = root.Find("reasons"))
    for (const auto& reason : reasons->Items()) outline.reasons.push_back(reason.String());
  ReadChannels(root, outline);
  return outline;
}

Capture CaptureOfOutline(const MaterialOutline& outline, const std::filesystem::path& file) {
  Capture capture;
  capture.file = file;
  capture.folder = file.parent_path();
  for (const std::string& name : outline.layers) {
    LayerSpec layer;
    layer.name = name;
    for (size_t q = 0; q < kParameters.size(); ++q)
      layer.parameters[q] = DefaultSpec(kParameters[q], outline.channels());
    capture.layers.push_back(layer);
  }
  for (size_t q = 0; q < kParameters.size(); ++q) capture.surface[q] = DefaultSpec(kParameters[q], outline.channels());
  if (outline.channel_names) capture.channel_names = *outline.channel_names;
  if (outline.wavelengths_nm) capture.wavelengths_nm = *outline.wavelengths_nm;
  return capture;
}

void WriteHandSetMaterial(const std::filesystem::path& file, const Capture& capture, const Material& material,
                          const std::map<std::string, double>& linear_scales, const std::string& made_from) {
  JsonValue::Array channels, layers;
  for (size_t c = 0; c < capture.channel_names.size(); ++c)
    channels.push_back(
        JsonValue::Object{{"name", capture.channel_names[c]}, {"wavelength_nm", capture.wavelengths_nm[c]}});
  for (size_t l = 0; l < material.layers.size(); ++l) {
    JsonValue::Object layer{{"name", material.layers[l].name}};
    for (const ParameterRow& row : kParameters)
      if (IsOfLayer(capture, l, row)) layer.emplace_back(row.key, FixedValue(material.layers[l][row.quantity], row));
    layers.push_back(layer);
  }
  JsonValue::Object surface, scales;
  for (const ParameterRow& row : kParameters)
    if (IsOfSurface(capture, row)) surface.emplace_back(row.key, FixedValue(material.surface[row.quantity], row));
  for (const auto& [name, value] : linear_scales) scales.emplace_back(name, value);
  WriteTextFile(
      file,
      ToJsonText(JsonValue::Object{
          {"format", kFormat},
          {"status", "not_usable"},
          {"reasons", std::vector<std::string>{"the values were set by hand in the viewer and do not come from a fit"}},
          {"channels", channels},
          {"layers", layers},
          {"surface", surface},
          {"linear_scales", scales},
          {"provenance", JsonValue::Object{{"note", "set by hand in crownfit view"}, {"made_from", made_from}}}}));
}

}  // namespace crownfit
