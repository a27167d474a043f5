#pragma once
// A layer as a capture states it: its shape, and the values of its parameters.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/parameters.h"

namespace crownfit {

/// Thickness of a layer that varies over the crown; multiplied by the layer's thickness_scale.
struct ThicknessField {
  std::array<double, 3> zones_mm{};  ///< in the middle of the cervical, middle and incisal third, smooth between
  std::string vertex_property;       ///< or the property with a number at every vertex of the layer's mesh
};

/// Unevenness of the junction to the next layer, added to the thickness; reproducible by its seed.
struct JunctionNoise {
  double amplitude_mm = 0;  ///< root mean square
  double wavelength_mm = 1;
  uint64_t seed = 1;
};

/// A factor on a layer's absorption that varies over its surface and is the same at every depth below it.
struct AbsorptionTextureSpec {
  std::optional<std::filesystem::path> file;   ///< a picture, by the mesh's texture coordinates; values as stored
  std::vector<std::string> vertex_properties;  ///< or numbers at the vertices: one name, or one per channel
  double low = 0, high = 1;                    ///< the factors for values of 0 and 1
};

struct LayerSpec {
  std::string name;
  std::optional<std::filesystem::path> surface;  ///< mesh; absent: inward offset of the layer above
  std::optional<ThicknessField> thickness_field;
  JunctionNoise junction_noise;
  std::optional<AbsorptionTextureSpec> absorption_texture;
  std::array<ParameterSpec, kParameters.size()> parameters;
  const ParameterSpec& operator[](Quantity q) const { return parameters[static_cast<size_t>(q)]; }
  ParameterSpec& operator[](Quantity q) { return parameters[static_cast<size_t>(q)]; }
};

}  // namespace crownfit
