#pragma once
// Predicted photographs as plain numbers, without derivatives.

#include <string>
#include <vector>

#include "optics/material.h"
#include "scene/cast_capture.h"
#include "shader/shader_model.h"

namespace crownfit {

/// The model's inputs. Each has a slot in the arrays below, a member of ShaderOptics and, in a capture, an owner.
struct Slot {
  enum Index : int {
    kOuterScattering,
    kOuterAbsorption,
    kOuterThickness,
    kOuterIor,
    kDiffuserScattering,
    kDiffuserAbsorption,
    kDiffuserThickness,
    kDiffuserIor,
    kDiffuserG,
    kRoughness,
    kWetness,
    kNeckReturn,
    kOuterG,
    kCount  ///< no slot: their number
  };
};
inline constexpr int kShaderSlots = Slot::kCount;

/// Layer and parameter of one slot.
struct ShaderSlot {
  size_t layer;  ///< kSurfaceOwner for the surface
  Quantity quantity;
};
inline constexpr size_t kSurfaceOwner = static_cast<size_t>(-1);

/// The owners of the slots in this capture. This model ignores layers below the second. Slots of an absent outer layer
/// have no owner.
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
  o.outer_scattering = s[Slot::kOuterScattering];
  o.outer_absorption = s[Slot::kOuterAbsorption];
  o.outer_thickness_scale = s[Slot::kOuterThickness];
  o.outer_ior = s[Slot::kOuterIor];
  o.diffuser_scattering = s[Slot::kDiffuserScattering];
  o.diffuser_absorption = s[Slot::kDiffuserAbsorption];
  o.diffuser_thickness_scale = s[Slot::kDiffuserThickness];
  o.diffuser_ior = s[Slot::kDiffuserIor];
  o.diffuser_g = s[Slot::kDiffuserG];
  o.roughness = s[Slot::kRoughness];
  o.wetness = s[Slot::kWetness];
  o.neck_return = s[Slot::kNeckReturn];
  o.outer_g = s[Slot::kOuterG];
  o.may_be_wet = s[Slot::kWetness] > 0.0 || !capture.surface[static_cast<size_t>(Quantity::kWetness)].fixed;
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
std::vector<std::vector<Spectrum>> PredictViews(const Capture& capture, const CastState& state, size_t photograph,
                                                std::span<const PhotographCast> casts, const Material& material,
                                                std::span<const double> light_scale, int threads);

/// Pixel values at exposure 1, one per pixel of the state's cast.
std::vector<Spectrum> PredictPixels(const Capture& capture, const CastState& state, size_t photograph,
                                    const Material& material, std::span<const double> light_scale, int threads);

/// Every light's intensity_scale as the capture states it.
std::vector<double> StatedLightScales(const Capture& capture);

}  // namespace crownfit
