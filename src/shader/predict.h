#pragma once
// Predicted photographs as plain numbers, without derivatives.

#include <string>
#include <vector>

#include "optics/material.h"
#include "scene/cast_capture.h"
#include "shader/shader_model.h"

namespace crownfit {

/// Layer and parameter of one slot of ShaderOptics, in the order of the slots below.
struct ShaderSlot {
  size_t layer;  ///< kSurfaceOwner for the surface
  Quantity quantity;
};
inline constexpr size_t kSurfaceOwner = static_cast<size_t>(-1);
inline constexpr int kShaderSlots = 13;

/// The slots of this capture: outer scattering, absorption, thickness, ior; diffuser scattering, absorption, thickness,
/// ior, g; roughness, wetness, the neck's reflectance; outer g. This model ignores layers below the second. Slots of an
/// absent outer layer have no owner.
std::array<std::optional<ShaderSlot>, kShaderSlots> SlotsOf(const Capture& capture);

/// Slot values of one channel; lengths are already divided by the cast ones.
std::array<double, kShaderSlots> SlotValues(const Capture& capture, const Material& material, const CastState& state,
                                            int channel);
/// d(slot) / d(parameter): 1, or 1 / cast thickness.
std::array<double, kShaderSlots> SlotDerivatives(const Capture& capture, const CastState& state);

template <class T>
ShaderOptics<T> OpticsFromSlots(const Capture& capture, const std::array<T, kShaderSlots>& s) {
  ShaderOptics<T> o;
  o.has_outer = capture.layers.size() > 1;
  o.outer_scattering = s[0];
  o.outer_absorption = s[1];
  o.outer_thickness_scale = s[2];
  o.outer_ior = s[3];
  o.diffuser_scattering = s[4];
  o.diffuser_absorption = s[5];
  o.diffuser_thickness_scale = s[6];
  o.diffuser_ior = s[7];
  o.diffuser_g = s[8];
  o.roughness = s[9];
  o.wetness = s[10];
  o.neck_return = s[11];
  o.outer_g = s[12];
  o.may_be_wet = s[10] > 0.0 || !capture.surface[static_cast<size_t>(Quantity::kWetness)].fixed;
  o.outside_ior = capture.outside_ior;
  return o;
}

/// Throws InputError with file and key for what the shader model does not support: tiles in contact, textures below the
/// outer layer, smooth surfaces.
void CheckShaderSupports(const Capture& capture);
/// The same check for a capture that is drawn with a material from elsewhere.
void CheckShaderSupports(const Capture& capture, const Material& material);

/// A note about the layers that the model ignores; empty when there are none.
std::string WhatShaderLeavesOut(const Capture& capture);

/// The vertices around the points that these pixels (indices into the cast's) show, without duplicates.
std::vector<int> VerticesAround(const Crown& crown, const PhotographCast& cast, std::span<const int> pixels);

/// Pixel values at exposure 1, of casts that differ only in the camera's position.
std::vector<std::vector<glm::dvec3>> PredictViews(const Capture& capture, const CastState& state, size_t photograph,
                                                  std::span<const PhotographCast> casts, const Material& material,
                                                  std::span<const double> light_scale, int threads);

/// Pixel values at exposure 1, one per pixel of the state's cast.
std::vector<glm::dvec3> PredictPixels(const Capture& capture, const CastState& state, size_t photograph,
                                      const Material& material, std::span<const double> light_scale, int threads);

/// Every light's intensity_scale as the capture states it.
std::vector<double> StatedLightScales(const Capture& capture);

}  // namespace crownfit
