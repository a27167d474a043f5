#include "optics/material.h"

namespace crownfit {

Material StatedMaterial(const Capture& capture) {
  Material material;
  for (const LayerSpec& spec : capture.layers) {
    Material::Layer layer;
    layer.name = spec.name;
    for (size_t i = 0; i < kParameters.size(); ++i) layer.values[i] = spec.parameters[i].value;
    material.layers.push_back(layer);
  }
  material.surface.name = "surface";
  for (size_t i = 0; i < kParameters.size(); ++i) material.surface.values[i] = capture.surface[i].value;
  return material;
}

}  // namespace crownfit
