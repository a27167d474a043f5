#include "scene/crown_source.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "capture/capture.h"
#include "geometry/mesh_file.h"
#include "scene/touching_layers.h"

namespace crownfit {
namespace {

constexpr double kThinnest_mm = 0.005;  // of a layer under noise and fields that reach 0

std::string ThicknessKey(size_t layer) { return "object.layers[" + std::to_string(layer) + "].thickness_mm"; }

/// Layer whose own mesh the offset surfaces from `layer` inward are measured from.
size_t BaseOf(const CrownSource& source, size_t layer) {
  while (!source.meshes[layer]) --layer;
  return layer;
}

/// Unmarks a cut that lies inside the next layer, as at the neck of a tooth scanned with its root.
void ForgetCoveredCut(TriangleMesh& mesh, const TriangleMesh& inner) {
  const RayCaster caster({&inner});
  for (size_t t = 0; t < mesh.is_cut.size(); ++t) {
    const glm::ivec3 f = mesh.triangles[t];
    const glm::dvec3 middle = (mesh.vertices[f.x] + mesh.vertices[f.y] + mesh.vertices[f.z]) / 3.0;
    if (mesh.is_cut[t] && IsInside(caster, inner, middle)) mesh.is_cut[t] = 0;
  }
  constexpr double kLeft_mm2 = 1.0;  // a rim between the layers
  if (Area(CutPart(mesh)) < kLeft_mm2) mesh.is_cut.clear();
}

/// Layers of one object must overlap or touch. Meshes of different frames may lie anywhere.
void CheckLayersMeet(const Capture& capture, const CrownSource& source) {
  constexpr double kApart_mm = 1.0;
  for (size_t i = 1; i < source.meshes.size(); ++i) {
    if (!source.meshes[i]) continue;
    const auto [low, high] = Bounds(*source.meshes[i]);
    double apart = HUGE_VAL;
    for (size_t k = 0; k < i; ++k) {
      if (!source.meshes[k]) continue;
      const auto [other_low, other_high] = Bounds(*source.meshes[k]);
      const glm::dvec3 gap = glm::max(low - other_high, other_low - high);
      apart = std::min(apart, std::max({gap.x, gap.y, gap.z}));
    }
    if (apart > kApart_mm)
      throw InputError(capture.file, capture.layers[i].name + ".surface",
                       "lies at least " + std::to_string(std::lround(apart)) + " mm away from every layer above it",
                       "Check that the meshes are in mm, and align the scans with each other.");
  }
}

}  // namespace

CrownSource ReadCrownSource(const Capture& capture, int threads) {
  CrownSource source;
  for (const LayerSpec& layer : capture.layers) {
    source.meshes.emplace_back();
    if (layer.surface) source.meshes.back() = ReadClosedSurface(*layer.surface, source.messages);
  }
  CheckLayersMeet(capture, source);
  std::vector<std::string> names;
  for (const LayerSpec& layer : capture.layers) names.push_back(layer.name);
  SeparateTouchingLayers(source.meshes, names, threads, source.messages);
  for (size_t i = 0; i + 1 < capture.layers.size(); ++i)
    if (source.meshes[i] && source.meshes[i + 1]) ForgetCoveredCut(*source.meshes[i], *source.meshes[i + 1]);
  source.fields.resize(capture.layers.size());
  source.thickness.resize(capture.layers.size());
  source.absorption.resize(capture.layers.size());
  for (size_t i = 0; i < capture.layers.size(); ++i)
    if (capture.layers[i].absorption_texture)
      source.absorption[i] =
          std::make_shared<AbsorptionTexture>(capture, i, *capture.layers[BaseOf(source, i)].surface, threads);
  for (size_t i = 1; i < capture.layers.size(); ++i) {
    if (source.meshes[i]) continue;
    const size_t base = BaseOf(source, i);
    const LayerSpec& above = capture.layers[i - 1];
    if (above.thickness_field || above.junction_noise.amplitude_mm > 0)
      source.thickness[i - 1] = std::make_shared<ThicknessMap>(
          capture, i - 1, source.meshes[i - 1] ? &*source.meshes[i - 1] : nullptr, *source.meshes[0]);
    if (!source.fields[base]) source.fields[base] = std::make_shared<DepthField>(*source.meshes[base], threads);
  }
  return source;
}

std::vector<double> StatedThicknesses(const Capture& capture) {
  std::vector<double> thickness;
  for (size_t i = 0; i < capture.layers.size(); ++i)
    thickness.push_back(capture.layers[i][ThicknessQuantity(capture, i)].value[0]);
  return thickness;
}

std::vector<std::string> KeepBuildable(const CrownSource& source, Capture& capture) {
  constexpr double kLeft = 0.05, kStart = 0.5;  // of the greatest depth
  std::vector<std::string> messages;
  for (size_t i = 1; i < capture.layers.size(); ++i) {
    const ParameterSpec& spec = capture.layers[i - 1][Quantity::kThickness];
    if (source.meshes[i] || source.thickness[i - 1]) continue;
    const size_t base = BaseOf(source, i);
    double room = (1.0 - kLeft) * source.fields[base]->max_depth_mm();
    for (size_t k = base; k + 1 < i; ++k) room -= capture.layers[k][ThicknessQuantity(capture, k)].value[0];
    if (room <= spec.low || spec.high <= room) continue;
    ParameterSpec& kept = capture.layers[i - 1][Quantity::kThickness];
    kept.high = room;
    if (kept.fixed || kept.value[0] < room) continue;
    messages.push_back(
        Printed("%s: the start value %.3g mm leaves no room for layer '%s', because '%s' is at most %.3g mm deep; the "
                "fit starts at %.3g mm",
                ThicknessKey(i - 1).c_str(), kept.value[0], capture.layers[i].name.c_str(),
                capture.layers[base].name.c_str(), source.fields[base]->max_depth_mm(), kStart * room));
    kept.value.fill(std::max(kept.low, kStart * room));
  }
  return messages;
}

std::vector<TriangleMesh> BuildSurfaces(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness) {
  std::vector<TriangleMesh> surfaces;
  for (size_t i = 0; i < capture.layers.size(); ++i) {
    if (source.meshes[i]) {
      surfaces.push_back(*source.meshes[i]);
      continue;
    }
    const size_t base = BaseOf(source, i);
    const auto depth_mm = [&](const glm::dvec3& p) {
      double depth = 0;
      for (size_t k = base; k < i; ++k)
        depth += source.thickness[k] ? source.thickness[k]->At(p, thickness[k]) : thickness[k];
      return std::max(depth, kThinnest_mm);
    };
    auto surface = source.fields[base]->LevelSurface(depth_mm);
    if (!surface)
      throw InputError(capture.file, ThicknessKey(i - 1),
                       "no room is left for layer '" + capture.layers[i].name + "' below '" +
                           capture.layers[base].name + "', which is at most " +
                           std::to_string(source.fields[base]->max_depth_mm()) + " mm deep",
                       "State a smaller thickness, or check the mesh's scale.");
    surfaces.push_back(std::move(*surface));
  }
  return surfaces;
}

}  // namespace crownfit
