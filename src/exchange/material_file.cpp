#include "exchange/material_file.h"

#include "base/error.h"
#include "base/json_file.h"

namespace crownfit {
namespace {

/// A bare value, a list with one per channel, or an object that holds either as "value".
ChannelValues ReadValues(JsonNode node) {
  if (node.IsObject()) node = JsonObject(node, {"value", "stddev", "interval95", "status"}).Require("value");
  ChannelValues values;
  if (node.IsNumber()) {
    values.fill(node.Number());
  } else {
    const auto list = node.Numbers(size_t{kChannels});
    std::copy(list.begin(), list.end(), values.begin());
  }
  return values;
}

void ReadOwner(const JsonObject& object, Owner owner, Material::Layer& out) {
  for (size_t i = 0; i < kParameters.size(); ++i)
    if (kParameters[i].owner == owner)
      if (const auto node = object.Find(kParameters[i].key)) out.values[i] = ReadValues(*node);
}

}  // namespace

Material ReadMaterialFile(const std::filesystem::path& path, const Capture& capture) {
  const JsonFile file(path);
  const JsonObject root = file.RootOfFormat(
      "crownfit-material/1", {"model", "status", "reasons", "caveats", "channels", "layers", "surface", "viewer",
                              "image_error", "identifiability", "linear_scales", "provenance"});
  Material material = StatedMaterial(capture);
  std::vector<std::string> keys = ParameterKeys(Owner::kLayer);
  keys.emplace_back("name");
  const JsonNode layers = root.Require("layers");
  for (auto& layer : material.layers) {
    bool found = false;
    for (const auto& item : layers.Items()) {
      const JsonObject object(item, keys);
      if (object.Require("name").String() != layer.name) continue;
      ReadOwner(object, Owner::kLayer, layer);
      found = true;
    }
    if (!found) layers.Fail("holds no layer called '" + layer.name + "', which the capture has");
  }
  if (const auto surface = root.Find("surface"))
    ReadOwner(JsonObject(*surface, ParameterKeys(Owner::kSurface)), Owner::kSurface, material.surface);
  return material;
}

}  // namespace crownfit
