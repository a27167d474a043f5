#include "capture/read_object.h"

#include "base/error.h"
#include "capture/poses.h"

namespace crownfit {
namespace {

constexpr double kSmallestTile_mm = 1e-3;

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

}  // namespace

std::filesystem::path ReadPath(const JsonNode& node, Capture& capture) {
  const std::string text = node.String();
  if (text.empty()) node.Fail("the path is empty");
  capture.input_files.push_back(capture.folder / text);
  return capture.input_files.back();
}

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

}  // namespace crownfit
