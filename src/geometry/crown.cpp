#include "geometry/crown.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

constexpr double kStart_mm = 1e-3;        // rays into the object start this far below its surface
constexpr double kThinnest_mm = 0.005;    // of a layer under noise and fields that reach 0
constexpr double kFineEdge_mm = 0.2;      // light is gathered on vertices no farther apart than this ...
constexpr size_t kFineTriangles = 60000;  // ... unless that takes more triangles

std::string ThicknessKey(size_t layer) { return "object.layers[" + std::to_string(layer) + "].thickness_mm"; }

/// Layer whose own mesh the offset surfaces from `layer` inward are measured from.
size_t BaseOf(const CrownSource& source, size_t layer) {
  while (!source.meshes[layer]) --layer;
  return layer;
}

/// Distance after which a ray enters the closed surface: 0 when it starts inside.
std::optional<double> DistanceInto(const TriangleMesh& surface, const RayCaster& caster, const glm::dvec3& start,
                                   const glm::dvec3& direction, double max_mm = kFar) {
  const auto hit = caster.Nearest(start, direction);
  if (!hit) return std::nullopt;
  if (glm::dot(FaceNormal(surface, hit->point.triangle), direction) > 0) return 0.0;
  return hit->distance_mm < max_mm ? std::optional(hit->distance_mm) : std::nullopt;
}

Chord CastChord(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal, const glm::dvec3& inward) {
  const glm::dvec3 start = position - kStart_mm * normal;
  Chord chord;
  const auto out = crown.fine_caster.Nearest(start, inward);
  if (!out) return chord;
  chord.total_mm = out->distance_mm + kStart_mm;
  if (!crown.has_outer_layer()) return chord;
  chord.front.fixed_mm = chord.back.fixed_mm = 0.5 * chord.total_mm;
  const auto in = DistanceInto(crown.surfaces[1], crown.casters[1], start, inward, out->distance_mm);
  if (!in) return chord;
  const glm::dvec3 far_side = start + (out->distance_mm - kStart_mm) * inward;
  const auto back = DistanceInto(crown.surfaces[1], crown.casters[1], far_side, -inward, out->distance_mm);
  const auto length = [](double d) { return d > 0 ? d + kStart_mm : 0.0; };  // 0: the inner layer itself is outermost
  chord.front = {0.0, length(*in)};
  const double left = chord.total_mm - chord.front.scaled_mm;
  chord.back = {0.0, std::min(back ? length(*back) : left, left)};
  return chord;
}

Column CastColumn(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal) {
  constexpr double kReach =
      2.0;  // to the side, in straight chords: set by path-traced pictures (docs/forward_model.md)
  constexpr double kCosine[] = {0.1127016653792583, 0.5, 0.8872983346207417},
                   kWeight[] = {5 / 18.0, 8 / 18.0, 5 / 18.0};
  constexpr int kAround = 6;
  const auto [u, v] = Tangents(normal);
  Chord straight = CastChord(crown, position, normal, -normal);
  if (straight.total_mm == 0)  // a ray can slip through where triangles of a symmetric mesh meet exactly opposite
    straight = CastChord(crown, position, normal, glm::normalize(1e-3 * u + 7e-4 * v - normal));
  Column column;
  column.straight = straight;
  const auto add = [&](double weight, const Chord& chord) {
    column.front.Add(weight, chord.front);
    column.back.Add(weight, chord.back);
    column.total_mm += weight * chord.total_mm;
  };
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * (k + i / 3.0) / kAround,
                   sine = std::sqrt(1 - kCosine[i] * kCosine[i]);
      const Chord chord =
          CastChord(crown, position, normal, sine * (std::cos(angle) * u + std::sin(angle) * v) - kCosine[i] * normal);
      const double aside = chord.total_mm * sine / std::max(kReach * straight.total_mm, 1e-9),
                   near = std::exp(-aside * aside), share = kWeight[i] / kAround;
      add(share * near * kCosine[i], chord);
      add(share * (1 - near), straight);
    }
  return column;
}

/// The object's outer surface: of the layers' triangles, split to `edge_mm`, those that no other of the two outermost
/// layers holds. Where the inner one stands out, as a root, the seam between the two is not sewn.
TriangleMesh OuterSurface(const Crown& crown, double edge_mm) {
  TriangleMesh outer = Refined(crown.surfaces[0], edge_mm);
  if (!crown.has_outer_layer()) return outer;
  const TriangleMesh& inner = crown.surfaces[1];
  const auto stands_out = [&](const glm::dvec3& p) { return !IsInside(crown.casters[0], crown.surfaces[0], p); };
  if (std::none_of(inner.vertices.begin(), inner.vertices.end(), stands_out)) return outer;

  TriangleMesh united;
  const auto add = [&](const TriangleMesh& mesh, size_t other) {
    std::vector<int> target(mesh.vertices.size(), -1);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
      const glm::ivec3 f = mesh.triangles[t];
      const glm::dvec3 middle = (mesh.vertices[f.x] + mesh.vertices[f.y] + mesh.vertices[f.z]) / 3.0;
      if (IsInside(crown.casters[other], crown.surfaces[other], middle)) continue;
      for (int k = 0; k < 3; ++k) {
        if (target[f[k]] >= 0) continue;
        target[f[k]] = static_cast<int>(united.vertices.size());
        united.vertices.push_back(mesh.vertices[f[k]]);
      }
      united.triangles.emplace_back(target[f.x], target[f.y], target[f.z]);
      united.is_cut.push_back(mesh.cut(static_cast<int>(t)));
    }
  };
  add(outer, 1);
  add(Refined(inner, edge_mm), 0);
  return united;
}

/// Area mean over what of `from` lies outside the closed surface `inner`.
double MeanDistance(const TriangleMesh& from, const TriangleMesh& inner, const RayCaster& to) {
  double sum = 0, area = 0;
  for (size_t t = 0; t < from.triangles.size(); ++t) {
    const glm::ivec3 f = from.triangles[t];
    const glm::dvec3 a = from.vertices[f.x], b = from.vertices[f.y], c = from.vertices[f.z];
    if (IsInside(to, inner, (a + b + c) / 3.0)) continue;
    const double w = glm::length(glm::cross(b - a, c - a));
    sum += w * to.DistanceToSurface((a + b + c) / 3.0);
    area += w;
  }
  return sum / area;
}

/// A cut that lies inside the next layer, as at the neck of a tooth scanned with its root, is none.
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

}  // namespace

CrownSource ReadCrownSource(const Capture& capture, int threads) {
  CrownSource source;
  for (const LayerSpec& layer : capture.layers) {
    source.meshes.emplace_back();
    if (layer.surface) source.meshes.back() = ReadClosedSurface(*layer.surface, source.messages);
  }
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
    char text[300];
    std::snprintf(text, sizeof text,
                  "%s: the start %.3g mm leaves nothing of layer '%s', as '%s' is at most %.3g mm deep; %.3g mm taken",
                  ThicknessKey(i - 1).c_str(), kept.value[0], capture.layers[i].name.c_str(),
                  capture.layers[base].name.c_str(), source.fields[base]->max_depth_mm(), kStart * room);
    messages.emplace_back(text);
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
                       "nothing of layer '" + capture.layers[i].name + "' is left below '" + capture.layers[base].name +
                           "', which is at most " + std::to_string(source.fields[base]->max_depth_mm()) + " mm deep",
                       "State a smaller thickness, or check the mesh's scale.");
    surfaces.push_back(std::move(*surface));
  }
  return surfaces;
}

std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness, int threads, const TapKernel& kernel) {
  auto crown = std::make_shared<Crown>();
  crown->surfaces = BuildSurfaces(capture, source, thickness);
  for (const auto& surface : crown->surfaces) crown->casters.emplace_back(std::vector<const TriangleMesh*>{&surface});

  double edge = kFineEdge_mm;
  const double wanted = std::sqrt(4.0 * Area(crown->surfaces[0]) / kFineTriangles);
  crown->fine = OuterSurface(*crown, std::max(edge, wanted));
  crown->fine_corner_normals = CornerNormals(crown->fine);
  crown->fine_vertex_normals.assign(crown->fine.vertices.size(), glm::dvec3(0.0));
  for (size_t t = 0; t < crown->fine.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      crown->fine_vertex_normals[crown->fine.triangles[t][k]] += crown->fine_corner_normals[t][k];
  for (auto& n : crown->fine_vertex_normals) n = glm::length(n) > 0 ? glm::normalize(n) : glm::dvec3(0, 0, 1);
  crown->fine_caster = RayCaster({&crown->fine});
  crown->cut = CutPart(crown->surfaces[0]);
  crown->cut_caster = RayCaster({&crown->cut});
  crown->columns.resize(crown->fine.vertices.size());
  ParallelFor(crown->columns.size(), threads, [&](size_t v) {
    crown->columns[v] = CastColumn(*crown, crown->fine.vertices[v], crown->fine_vertex_normals[v]);
    if (source.absorption[0]) crown->columns[v].outer_absorption = source.absorption[0]->At(crown->fine.vertices[v]);
  });

  crown->kernel = kernel;
  std::vector<std::vector<Tap>> taps(crown->fine.vertices.size());
  ParallelFor(taps.size(), threads, [&](size_t v) {
    taps[v] = CastTaps(*crown, kernel, crown->fine.vertices[v], crown->fine_vertex_normals[v],
                       crown->columns[v].total_mm, /*tooth_goes_on=*/capture.neck == Neck::kRoot);
  });
  for (const auto& at_vertex : taps) {
    crown->first_tap.push_back(static_cast<int>(crown->taps.size()));
    crown->taps.insert(crown->taps.end(), at_vertex.begin(), at_vertex.end());
  }
  crown->first_tap.push_back(static_cast<int>(crown->taps.size()));

  for (size_t i = 0; i < crown->surfaces.size(); ++i) {
    if (i + 1 == crown->surfaces.size()) {
      std::vector<double> depth;
      for (const Column& c : crown->columns)
        depth.push_back(c.straight.total_mm - c.straight.front.total_mm() - c.straight.back.total_mm());
      std::nth_element(depth.begin(), depth.begin() + static_cast<long>(depth.size() / 2), depth.end());
      crown->thickness_mm.push_back(depth[depth.size() / 2]);
    } else {
      const bool is_even = !source.meshes[i + 1] && !source.thickness[i];
      crown->thickness_mm.push_back(
          is_even ? thickness[i]
                  : MeanDistance(ScannedPart(crown->surfaces[i]), crown->surfaces[i + 1], crown->casters[i + 1]));
      if (!std::isfinite(crown->thickness_mm.back()))
        throw InputError(capture.file, capture.layers[i].name + ".surface",
                         "lies everywhere inside '" + capture.layers[i + 1].name + "', the layer below it",
                         "Are the two meshes swapped, or in different units?");
    }
  }
  return crown;
}

glm::dvec3 ShadingNormal(const Crown& crown, const SurfacePoint& p) {
  const auto& n = crown.fine_corner_normals[p.triangle];
  return glm::normalize(p.weights.x * n[0] + p.weights.y * n[1] + p.weights.z * n[2]);
}

}  // namespace crownfit
