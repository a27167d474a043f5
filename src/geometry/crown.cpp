#include "geometry/crown.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

constexpr double kStart_mm = 1e-3;        // rays into the object start this far below its surface
constexpr double kFineEdge_mm = 0.2;      // light is gathered on vertices no farther apart than this ...
constexpr size_t kFineTriangles = 60000;  // ... unless that takes more triangles

std::string ThicknessKey(size_t layer) { return "object.layers[" + std::to_string(layer) + "].thickness_mm"; }

/// Layer whose own mesh the offset surfaces from `layer` inward are measured from.
size_t BaseOf(const CrownSource& source, size_t layer) {
  while (!source.meshes[layer]) --layer;
  return layer;
}

Column CastColumn(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal) {
  const glm::dvec3 start = position - kStart_mm * normal, inward = -normal;
  Column column;
  const auto out = crown.fine_caster.Nearest(start, inward);
  if (!out) return column;  // a corner so sharp that the inward normal misses the object: no depth
  column.total_mm = out->distance_mm + kStart_mm;
  column.opposite = out->point;
  if (!crown.has_outer_layer()) return column;
  column.front.fixed_mm = column.back.fixed_mm = 0.5 * column.total_mm;
  const auto in = crown.casters[1].Nearest(start, inward, 0.0, out->distance_mm);
  if (!in) return column;
  const glm::dvec3 far_side = start + out->distance_mm * inward - kStart_mm * inward;
  const auto back = crown.casters[1].Nearest(far_side, normal, 0.0, out->distance_mm);
  column.front = {0.0, in->distance_mm + kStart_mm};
  const double left = column.total_mm - column.front.scaled_mm;
  column.back = {0.0, std::min(back ? back->distance_mm + kStart_mm : left, left)};
  return column;
}

double MeanDistance(const TriangleMesh& from, const RayCaster& to) {
  double sum = 0, area = 0;
  for (size_t t = 0; t < from.triangles.size(); ++t) {
    const glm::ivec3 f = from.triangles[t];
    const glm::dvec3 a = from.vertices[f.x], b = from.vertices[f.y], c = from.vertices[f.z];
    const double w = glm::length(glm::cross(b - a, c - a));
    sum += w * to.DistanceToSurface((a + b + c) / 3.0);
    area += w;
  }
  return sum / area;
}

}  // namespace

CrownSource ReadCrownSource(const Capture& capture, int threads) {
  CrownSource source;
  for (const LayerSpec& layer : capture.layers) {
    source.meshes.emplace_back();
    if (layer.surface) source.meshes.back() = ReadClosedSurface(*layer.surface, source.messages);
  }
  source.fields.resize(capture.layers.size());
  for (size_t i = 1; i < capture.layers.size(); ++i) {
    if (source.meshes[i]) continue;
    const size_t base = BaseOf(source, i);
    if (!source.fields[base]) source.fields[base] = std::make_shared<DepthField>(*source.meshes[base], threads);
  }
  return source;
}

std::vector<double> StatedThicknesses(const Capture& capture) {
  std::vector<double> thickness;
  for (const LayerSpec& layer : capture.layers) thickness.push_back(layer[Quantity::kThickness].value[0]);
  return thickness;
}

std::vector<TriangleMesh> BuildSurfaces(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness_mm) {
  std::vector<TriangleMesh> surfaces;
  for (size_t i = 0; i < capture.layers.size(); ++i) {
    if (source.meshes[i]) {
      surfaces.push_back(*source.meshes[i]);
      continue;
    }
    const size_t base = BaseOf(source, i);
    double depth = 0;
    for (size_t k = base; k < i; ++k) depth += thickness_mm[k];
    auto surface = source.fields[base]->LevelSurface(depth);
    if (!surface)
      throw InputError(capture.file, ThicknessKey(i - 1),
                       "nothing of layer '" + capture.layers[i].name + "' is left " + std::to_string(depth) +
                           " mm below '" + capture.layers[base].name + "', which is at most " +
                           std::to_string(source.fields[base]->max_depth_mm()) + " mm deep",
                       "State a smaller thickness, or check the mesh's scale.");
    surfaces.push_back(std::move(*surface));
  }
  return surfaces;
}

std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness_mm, int threads) {
  auto crown = std::make_shared<Crown>();
  crown->surfaces = BuildSurfaces(capture, source, thickness_mm);
  for (const auto& surface : crown->surfaces) crown->casters.emplace_back(std::vector<const TriangleMesh*>{&surface});

  double edge = kFineEdge_mm;
  const double wanted = std::sqrt(4.0 * Area(crown->surfaces[0]) / kFineTriangles);
  crown->fine = Refined(crown->surfaces[0], std::max(edge, wanted));
  crown->fine_corner_normals = CornerNormals(crown->fine);
  crown->fine_vertex_normals.assign(crown->fine.vertices.size(), glm::dvec3(0.0));
  for (size_t t = 0; t < crown->fine.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      crown->fine_vertex_normals[crown->fine.triangles[t][k]] += crown->fine_corner_normals[t][k];
  for (auto& n : crown->fine_vertex_normals) n = glm::length(n) > 0 ? glm::normalize(n) : glm::dvec3(0, 0, 1);
  crown->fine_caster = RayCaster({&crown->fine});
  crown->columns.resize(crown->fine.vertices.size());
  ParallelFor(crown->columns.size(), threads, [&](size_t v) {
    crown->columns[v] = CastColumn(*crown, crown->fine.vertices[v], crown->fine_vertex_normals[v]);
  });

  for (size_t i = 0; i < crown->surfaces.size(); ++i) {
    if (i + 1 == crown->surfaces.size()) {
      double sum = 0;
      for (const Column& c : crown->columns) sum += c.total_mm - c.front.total_mm() - c.back.total_mm();
      crown->thickness_mm.push_back(sum / static_cast<double>(crown->columns.size()));
    } else {
      const bool is_offset = !source.meshes[i + 1];
      crown->thickness_mm.push_back(is_offset ? thickness_mm[i]
                                              : MeanDistance(crown->surfaces[i], crown->casters[i + 1]));
    }
  }
  return crown;
}

glm::dvec3 ShadingNormal(const Crown& crown, const SurfacePoint& p) {
  const auto& n = crown.fine_corner_normals[p.triangle];
  return glm::normalize(p.weights.x * n[0] + p.weights.y * n[1] + p.weights.z * n[2]);
}

OuterLength OuterPath(const Crown& crown, const glm::dvec3& position, const glm::dvec3& normal,
                      const glm::dvec3& towards_outside, double relative_ior) {
  if (!crown.has_outer_layer()) return {};
  const glm::dvec3 tangential = (towards_outside - glm::dot(towards_outside, normal) * normal) / relative_ior;
  const double inside_cosine = std::sqrt(std::max(0.0, 1.0 - glm::dot(tangential, tangential)));
  const glm::dvec3 direction = -tangential - inside_cosine * normal;
  const glm::dvec3 start = position - kStart_mm * normal;
  const auto in = crown.casters[1].Nearest(start, direction);
  const auto out = crown.fine_caster.Nearest(start, direction);
  if (in && (!out || in->distance_mm < out->distance_mm)) return {0.0, in->distance_mm + kStart_mm};
  return {out ? 0.5 * (out->distance_mm + kStart_mm) : 0.0, 0.0};
}

}  // namespace crownfit
