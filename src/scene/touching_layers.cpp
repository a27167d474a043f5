#include "scene/touching_layers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/parallel.h"
#include "base/text.h"
#include "geometry/mesh_edges.h"
#include "geometry/ray_caster.h"

namespace crownfit {
namespace {

constexpr double kTouching_mm = 1e-4;  // inwards: a thinner film of the layer above is none
constexpr double kProud_mm = 4e-3;     // twice how far from the surface rays start, so that none skips the step

std::vector<glm::dvec3> VertexNormals(const TriangleMesh& mesh) {
  std::vector<glm::dvec3> normals(mesh.vertices.size(), glm::dvec3(0.0));
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::dvec3 normal = FaceNormal(mesh, static_cast<int>(t));
    for (int k = 0; k < 3; ++k) {
      const glm::ivec3& f = mesh.triangles[t];
      const glm::dvec3 u = glm::normalize(mesh.vertices[f[(k + 1) % 3]] - mesh.vertices[f[k]]),
                       v = glm::normalize(mesh.vertices[f[(k + 2) % 3]] - mesh.vertices[f[k]]);
      normals[f[k]] += std::acos(std::clamp(glm::dot(u, v), -1.0, 1.0)) * normal;
    }
  }
  for (glm::dvec3& n : normals)
    if (glm::length(n) > 0) n = glm::normalize(n);
  return normals;
}

/// Where a vertex lies on `above`, or at most `proud_mm` outside of it.
std::optional<glm::dvec3> PlaceOn(const TriangleMesh& above, const RayCaster& caster, const glm::dvec3& p,
                                  double proud_mm) {
  const double distance = caster.DistanceToSurface(p, proud_mm);
  if (!(distance < proud_mm)) return std::nullopt;
  const SurfacePoint nearest = caster.ClosestPoint(p);
  const glm::dvec3 place = Position(above, nearest);
  const bool is_outside = glm::dot(p - place, FaceNormal(above, nearest.triangle)) > 0;
  return distance <= kTouching_mm || is_outside ? std::optional(place) : std::nullopt;
}

}  // namespace

void SeparateTouchingLayers(std::vector<std::optional<TriangleMesh>>& meshes, const std::vector<std::string>& names,
                            int threads, std::vector<std::string>& messages) {
  const std::vector<std::optional<TriangleMesh>> stated = meshes;
  for (size_t inner = 1; inner < meshes.size(); ++inner) {
    if (!meshes[inner]) continue;
    TriangleMesh& mesh = *meshes[inner];
    const double proud_mm = kProud_mm * static_cast<double>(inner);  // of three that touch, each beyond the one above
    const std::vector<glm::dvec3> normals = VertexNormals(mesh);
    for (size_t outer = 0; outer < inner; ++outer) {
      if (!stated[outer]) continue;
      const RayCaster caster({&*stated[outer]});
      std::vector<uint8_t> touches(mesh.vertices.size(), 0);
      ParallelFor(mesh.vertices.size(), threads, [&](size_t v) {
        const auto place = PlaceOn(*stated[outer], caster, stated[inner]->vertices[v], proud_mm);
        if (!place) return;
        touches[v] = 1;
        mesh.vertices[v] = *place + proud_mm * normals[v];
      });
      double area_mm2 = 0;
      for (const glm::ivec3& t : mesh.triangles)
        if (touches[t.x] && touches[t.y] && touches[t.z]) area_mm2 += AreaOf(*stated[inner], t);
      if (area_mm2 > 0)
        messages.push_back(
            Printed("'%s' and '%s' have %.3g mm2 of their surfaces in common: there '%s', the inner layer, ends the "
                    "object; its mesh was moved outwards by %.3g mm",
                    names[outer].c_str(), names[inner].c_str(), area_mm2, names[inner].c_str(), proud_mm));
    }
  }
}

}  // namespace crownfit
