#include "scene/build_crown.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "capture/capture.h"
#include "scene/taps.h"

namespace crownfit {
namespace {

constexpr double kStart_mm = 1e-3;  // rays into the object start this far below its surface

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
  const auto out = WayOut(crown, start, inward);
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
      2.0;  // lateral reach, in straight chords: set by path-traced pictures (docs/forward_model.md)
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

/// Whether a layer ends where the one below it does, everywhere (touching_layers.h). Deeper inside, meshes are swapped.
bool IsCoveredByAHair(const TriangleMesh& layer, const RayCaster& below) {
  constexpr double kHair_mm = 0.05;
  return std::all_of(layer.vertices.begin(), layer.vertices.end(),
                     [&](const glm::dvec3& v) { return below.DistanceToSurface(v) < kHair_mm; });
}

/// A layer's surface, split to `edge_mm`.
TriangleMesh FineSurface(const Crown& crown, size_t layer, double edge_mm, const CrownDetail& detail) {
  const TriangleMesh& surface = crown.surfaces[layer];
  if (!detail.simplifies) return Refined(surface, edge_mm);
  const TriangleMesh simple = Simplified(surface, detail.fine_triangles);
  TriangleMesh fine = Refined(simple, edge_mm);
  for (; fine.triangles.size() > 2 * detail.fine_triangles; edge_mm *= 1.5) fine = Refined(simple, edge_mm);
  for (glm::dvec3& v : fine.vertices) v = Position(surface, crown.casters[layer].ClosestPoint(v));
  return fine;
}

/// The object's outer surface: the triangles of the two outermost layers, split to `edge_mm`, that lie outside the
/// other layer. Where the inner layer protrudes, as a root, the seam between the two stays open.
TriangleMesh OuterSurface(const Crown& crown, double edge_mm, const CrownDetail& detail) {
  TriangleMesh outer = FineSurface(crown, 0, edge_mm, detail);
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
  add(FineSurface(crown, 1, edge_mm, detail), 0);
  return united;
}

/// Area-weighted mean over the part of `from` that lies outside the closed surface `inner`.
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

}  // namespace

double FineEdge_mm(const TriangleMesh& surface, size_t triangles) {
  constexpr double kFinest_mm = 0.2;
  return std::max(kFinest_mm, std::sqrt(4.0 * Area(surface) / static_cast<double>(triangles)));
}

std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness, int threads, const CrownDetail& detail) {
  auto crown = std::make_shared<Crown>();
  crown->surfaces = BuildSurfaces(capture, source, thickness);
  for (const auto& surface : crown->surfaces) crown->casters.emplace_back(std::vector<const TriangleMesh*>{&surface});

  crown->fine = OuterSurface(*crown, FineEdge_mm(crown->surfaces[0], detail.fine_triangles), detail);
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
  if (source.absorption[0]) crown->outer_absorption.resize(crown->columns.size());
  ParallelFor(crown->columns.size(), threads, [&](size_t v) {
    crown->columns[v] = CastColumn(*crown, crown->fine.vertices[v], crown->fine_vertex_normals[v]);
    if (source.absorption[0]) crown->outer_absorption[v] = source.absorption[0]->At(crown->fine.vertices[v]);
  });

  crown->kernel = detail.kernel;
  std::vector<std::vector<Tap>> taps(crown->fine.vertices.size());
  ParallelFor(taps.size(), threads, [&](size_t v) {
    taps[v] = CastTaps(*crown, detail.kernel, crown->fine.vertices[v], crown->fine_vertex_normals[v],
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
      if (std::isfinite(crown->thickness_mm.back())) continue;
      if (!IsCoveredByAHair(crown->surfaces[i], crown->casters[i + 1]))
        throw InputError(capture.file, capture.layers[i].name + ".surface",
                         "lies completely inside '" + capture.layers[i + 1].name + "', the layer below it",
                         "Check that the two meshes are not swapped, and that both are in mm.");
      crown->thickness_mm.back() = 0;
    }
  }
  return crown;
}

}  // namespace crownfit
