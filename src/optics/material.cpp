#include "optics/material.h"

#include "capture/capture.h"
#include "optics/media.h"

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

Slab SlabOf(const Material& material, int channel) {
  Slab slab;
  for (const auto& layer : material.layers) {
    SlabLayer s;
    s.ior = layer[Quantity::kIor][channel];
    s.g = layer[Quantity::kAsymmetry][channel];
    s.isotropic_fraction = layer[Quantity::kIsotropicFraction][channel];
    s.scattering_per_mm = TrueScattering(layer[Quantity::kReducedScattering][channel], s.g, s.isotropic_fraction);
    s.absorption_per_mm = layer[Quantity::kAbsorption][channel];
    slab.layers.push_back(s);
  }
  return slab;
}

Spectrum HalfSpaceReflectance(const Material::Layer& layer) {
  Spectrum reflectance = layer[Quantity::kReducedScattering];
  for (int c = 0; c < reflectance.size(); ++c)
    reflectance[c] = HalfSpaceReflectance(layer[Quantity::kReducedScattering][c], layer[Quantity::kAbsorption][c]);
  return reflectance;
}

std::vector<double> ThicknessesOf(const Capture& capture, const Material& material) {
  std::vector<double> thickness;
  for (size_t i = 0; i < capture.layers.size(); ++i)
    thickness.push_back(material.layers[i][ThicknessQuantity(capture, i)][0]);
  return thickness;
}

}  // namespace crownfit
