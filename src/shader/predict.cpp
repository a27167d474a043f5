#include "shader/predict.h"

#include <algorithm>
#include <numeric>

#include "base/error.h"
#include "capture/capture.h"

namespace crownfit {

std::array<std::optional<ShaderSlot>, kShaderSlots> SlotsOf(const Capture& capture) {
  std::array<std::optional<ShaderSlot>, kShaderSlots> slots;
  const size_t diffuser = capture.layers.size() > 1 ? 1 : 0;
  if (diffuser == 1) {
    slots[Slot::kOuterScattering] = {0, Quantity::kReducedScattering};
    slots[Slot::kOuterAbsorption] = {0, Quantity::kAbsorption};
    slots[Slot::kOuterThickness] = {0, ThicknessQuantity(capture, 0)};
    slots[Slot::kOuterIor] = {0, Quantity::kIor};
    slots[Slot::kOuterG] = {0, Quantity::kAsymmetry};
  }
  slots[Slot::kDiffuserScattering] = {diffuser, Quantity::kReducedScattering};
  slots[Slot::kDiffuserAbsorption] = {diffuser, Quantity::kAbsorption};
  // For the last layer of a flat sample thickness_mm moves the back face.
  const bool is_last = diffuser + 1 == capture.layers.size();
  if (is_last && capture.layers[diffuser][Quantity::kThickness].stated)
    slots[Slot::kDiffuserThickness] = {diffuser, Quantity::kThickness};
  slots[Slot::kDiffuserIor] = {diffuser, Quantity::kIor};
  slots[Slot::kDiffuserG] = {diffuser, Quantity::kAsymmetry};
  slots[Slot::kRoughness] = {kSurfaceOwner, Quantity::kRoughness};
  slots[Slot::kWetness] = {kSurfaceOwner, Quantity::kWetness};
  slots[Slot::kNeckReturn] = {kSurfaceOwner, Quantity::kNeckReturn};
  return slots;
}

std::array<double, kShaderSlots> SlotDerivatives(const Capture& capture, const CastState& state) {
  std::array<double, kShaderSlots> derivatives;
  derivatives.fill(1.0);
  const auto slots = SlotsOf(capture);
  // Lengths were cast at this thickness, except to a mesh, whose geometry is given. A last layer's stated thickness
  // describes its mesh.
  for (int i : {Slot::kOuterThickness, Slot::kDiffuserThickness})
    if (slots[i] && !(i == Slot::kOuterThickness && capture.layers[1].surface))
      derivatives[i] = 1.0 / state.thickness_mm[slots[i]->layer];
  return derivatives;
}

std::array<double, kShaderSlots> SlotValues(const Capture& capture, const Material& material, const CastState& state,
                                            int channel) {
  std::array<double, kShaderSlots> values{};
  values[Slot::kOuterThickness] = values[Slot::kDiffuserThickness] = values[Slot::kOuterIor] =
      values[Slot::kDiffuserIor] = 1.0;
  const auto slots = SlotsOf(capture);
  const auto derivatives = SlotDerivatives(capture, state);
  for (int i = 0; i < kShaderSlots; ++i) {
    if (!slots[i]) continue;
    const auto& owner = slots[i]->layer == kSurfaceOwner ? material.surface : material.layers[slots[i]->layer];
    values[i] = owner[slots[i]->quantity][channel] * derivatives[i];
  }
  return values;
}

static void CheckIsNoMirror(double roughness, const std::filesystem::path& file, const std::string& key) {
  const ParameterRow& row = RowOf(Quantity::kRoughness);
  if (roughness < row.low)
    throw InputError(file, key, "model shader needs a rough surface, not a mirror",
                     "Set the roughness to at least " + std::to_string(row.low) + ", or render with --model path.");
}

void CheckShaderSupports(const Capture& capture) {
  for (const PhotographSpec& photo : capture.photographs)
    if (photo.backing && capture.backings[*photo.backing].in_contact)
      throw InputError(capture.file, photo.key + ".backing",
                       "model shader does not know backings in optical contact, such as '" +
                           capture.backings[*photo.backing].name + "'",
                       "Photograph it with an air gap (\"contact\": false), or render with --model path.");
  for (size_t i = 0; i < capture.layers.size(); ++i)
    if (capture.layers[i].absorption_texture && (i > 0 || capture.layers.size() == 1))
      throw InputError(capture.file, "object.layers[" + std::to_string(i) + "].absorption_texture",
                       "model shader knows a texture only on the outer of two layers",
                       "Move it there, or render with --model path.");
  CheckIsNoMirror(capture.surface[static_cast<size_t>(Quantity::kRoughness)].value[0], capture.file,
                  "object.surface.roughness");
}

void CheckShaderSupports(const Capture& capture, const Material& material) {
  CheckShaderSupports(capture);
  CheckIsNoMirror(material.surface[Quantity::kRoughness][0], "", "the material's surface.roughness");
}

std::string WhatShaderLeavesOut(const Capture& capture) {
  const size_t layers = capture.layers.size();
  return layers <= 2 ? ""
                     : "model shader uses only the first two of " + std::to_string(layers) +
                           " layers; `crownfit render --model path` uses all";
}

std::vector<double> StatedLightScales(const Capture& capture) {
  std::vector<double> scales;
  for (const Light& light : capture.lights) scales.push_back(light.intensity_scale);
  return scales;
}

std::vector<int> VerticesAround(const Crown& crown, const PhotographCast& cast, std::span<const int> pixels) {
  std::vector<uint8_t> is_around(crown.fine.vertices.size(), 0);
  for (int p : pixels)
    for (int v : cast.pixels[p].at.vertices) is_around[v] = 1;
  std::vector<int> vertices;
  for (size_t v = 0; v < is_around.size(); ++v)
    if (is_around[v]) vertices.push_back(static_cast<int>(v));
  return vertices;
}

std::vector<std::vector<Spectrum>> PredictViews(const Capture& capture, const CastState& state, size_t photograph,
                                                std::span<const PhotographCast> casts, const Material& material,
                                                std::span<const double> light_scale, int threads) {
  const Polarisers polarisers = capture.photographs[photograph].polarisers();
  std::vector<std::vector<int>> around;
  std::vector<int> around_all;
  std::vector<std::vector<Spectrum>> values;
  for (const PhotographCast& cast : casts) {
    std::vector<int> all(cast.pixels.size());
    std::iota(all.begin(), all.end(), 0);
    around.push_back(VerticesAround(*state.crown, cast, all));
    around_all.insert(around_all.end(), around.back().begin(), around.back().end());
    values.emplace_back(cast.pixels.size(), Spectrum(capture.channels(), 0.0));
  }
  std::sort(around_all.begin(), around_all.end());
  around_all.erase(std::unique(around_all.begin(), around_all.end()), around_all.end());
  for (int c = 0; c < capture.channels() && !casts.empty(); ++c) {
    const auto optics = OpticsFromSlots(capture, SlotValues(capture, material, state, c));
    const DiffuserTable<double> table(optics.stack(), state.crown->kernel.outer_radius_mm);
    const ShaderPrediction<double> first(*state.crown, casts[0], optics, table, c, light_scale, around_all, threads);
    for (size_t k = 0; k < casts.size(); ++k) {
      const ShaderPrediction<double> view(first, casts[k], around[k], threads);
      ParallelFor(values[k].size(), threads,
                  [&](size_t i) { values[k][i][c] = view.Pixel(casts[k].pixels[i], polarisers); });
    }
  }
  return values;
}

std::vector<Spectrum> PredictPixels(const Capture& capture, const CastState& state, size_t photograph,
                                    const Material& material, std::span<const double> light_scale, int threads) {
  return PredictViews(capture, state, photograph, {&state.photographs[photograph], 1}, material, light_scale,
                      threads)[0];
}

}  // namespace crownfit
