#pragma once
// A material: values of every parameter of every layer, in the capture's channels.

#include <array>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "capture/parameters.h"
#include "optics/slab.h"

namespace crownfit {

struct Capture;

struct Material {
  struct Layer {
    std::string name;
    std::array<Spectrum, kParameters.size()> values{};
    Spectrum& operator[](Quantity q) { return values[static_cast<size_t>(q)]; }
    const Spectrum& operator[](Quantity q) const { return values[static_cast<size_t>(q)]; }
  };
  std::vector<Layer> layers;  ///< outermost first
  Layer surface;              ///< only the surface's rows are used
  int channels() const { return (layers.empty() ? surface : layers[0])[Quantity::kReducedScattering].size(); }
};

/// Initial and fixed values of a capture.
Material StatedMaterial(const Capture& capture);

/// Fraction of diffuse light that a half space of the layer returns, per channel (media.h).
Spectrum HalfSpaceReflectance(const Material::Layer& layer);

/// The layers as a flat sample of one channel, 1 mm each.
Slab SlabOf(const Material& material, int channel);

/// Thickness per layer, as BuildCrown expects it.
std::vector<double> ThicknessesOf(const Capture& capture, const Material& material);

}  // namespace crownfit
