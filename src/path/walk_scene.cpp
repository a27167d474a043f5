#include "path/walk_scene.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/parallel.h"
#include "geometry/signed_distance.h"

namespace crownfit {
LayeredBody::LayeredBody(std::vector<TriangleMesh> layer_surfaces, int threads,
                         std::vector<std::shared_ptr<const AbsorptionTexture>> textures)
    : surfaces(std::move(layer_surfaces)), absorption(std::move(textures)) {
  absorption.resize(surfaces.size());
  for (TriangleMesh& mesh : surfaces)  // rounded to single precision as rays are, so that all queries agree
    for (glm::dvec3& v : mesh.vertices)
      for (int k = 0; k < 3; ++k)
        v[k] = static_cast<double>(static_cast<float>(v[k]));  // g++ 12 forgets x, y of vec3(v)
  std::tie(low, high) = Bounds(surfaces[0]);
  for (const auto& mesh : surfaces) {
    const auto [a, b] = Bounds(mesh);
    low = glm::min(low, a), high = glm::max(high, b);
  }
  const glm::dvec3 rounding(1e-5 * glm::length(high - low));
  low -= rounding, high += rounding;

  is_exposed.resize(surfaces.size());
  for (size_t i = 1; i < surfaces.size(); ++i) {
    const TriangleMesh &mesh = surfaces[i], &above = surfaces[i - 1];
    const RayCaster caster({&above});
    std::vector<uint8_t> is_deep(mesh.vertices.size());  // below the layer above by more than the longest edge
    std::vector<double> longest(mesh.vertices.size(), 0.0);
    for (const glm::ivec3& t : mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const double edge = glm::distance(mesh.vertices[t[k]], mesh.vertices[t[(k + 1) % 3]]);
        longest[t[k]] = std::max(longest[t[k]], edge);
        longest[t[(k + 1) % 3]] = std::max(longest[t[(k + 1) % 3]], edge);
      }
    ParallelFor(mesh.vertices.size(), threads, [&](size_t v) {
      const glm::dvec3& p = mesh.vertices[v];
      is_deep[v] = IsInside(caster, above, p) && caster.DistanceToSurface(p) > longest[v];
    });
    for (const glm::ivec3& t : mesh.triangles) is_exposed[i].push_back(!(is_deep[t.x] && is_deep[t.y] && is_deep[t.z]));
  }
  grid = TriangleGrid(surfaces, is_exposed, low, high, threads);
}

WalkScene::WalkScene(const LayeredBody& body, const std::vector<TriangleMesh>& opaque)
    : body_(body), layers_(static_cast<int>(body.surfaces.size())) {
  for (const auto& mesh : body.surfaces) meshes_.push_back(&mesh);
  for (const auto& mesh : opaque) meshes_.push_back(&mesh);
  for (const auto* mesh : meshes_) {
    normals_.emplace_back();
    for (int t = 0; t < static_cast<int>(mesh->triangles.size()); ++t) normals_.back().push_back(FaceNormal(*mesh, t));
  }
  caster_ = RayCaster(meshes_);
}

bool WalkScene::Counts(int mesh, int triangle, const glm::dvec3& direction, int medium, const Boundary* left,
                       const IsThere& is_there) const {
  if (mesh >= layers_)
    return medium == kOutside && !(left && left->opaque == mesh - layers_ && left->triangle == triangle) &&
           (!is_there || is_there(mesh - layers_));
  const double along = glm::dot(normals_[mesh][triangle], direction);
  if (along > 0) return medium == mesh + 1;
  return along < 0 && (medium == mesh || (medium < mesh && body_.is_exposed[mesh][triangle]));
}

Boundary WalkScene::BoundaryAt(int mesh, int triangle, double distance_mm, const glm::dvec3& position,
                               const glm::dvec3& normal, int medium) const {
  if (mesh >= layers_) return {distance_mm, position, normal, kOutside, kOutside, mesh - layers_, triangle};
  Boundary boundary{distance_mm, position, normal, mesh + 1, mesh, -1, triangle, body_.surfaces[mesh].cut(triangle)};
  if (mesh > 0 && body_.is_exposed[mesh][triangle])
    boundary.outside = medium <= mesh ? medium : MediumOutside(mesh, position, normal);
  return boundary;
}

Boundary WalkScene::EndOf(const FacetFlight& flight) const {
  return BoundaryAt(flight.mesh, flight.triangle, flight.distance_mm,
                    flight.origin + flight.distance_mm * flight.direction, flight.normal, flight.medium);
}

std::optional<Boundary> WalkScene::Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium,
                                        double max_mm, const Boundary* left, const IsThere& is_there) const {
  if (medium != kOutside) {
    if (!std::isinf(max_mm) && body_.grid.IsFree(origin, direction, max_mm)) return std::nullopt;
    FacetFlight flight{origin, direction, medium, max_mm};
    body_.grid.FindEnds({&flight, 1});
    if (!flight.is_ended()) return std::nullopt;
    return EndOf(flight);
  }
  return NextByRay(origin, direction, medium, max_mm, left, is_there);
}

std::optional<Boundary> WalkScene::NextByRay(const glm::dvec3& origin, const glm::dvec3& direction, int medium,
                                             double max_mm, const Boundary* left, const IsThere& is_there) const {
  const auto hit = caster_.NearestAccepted(origin, direction, max_mm, [&](int mesh, int triangle) {
    return Counts(mesh, triangle, direction, medium, left, is_there);
  });
  if (!hit) return std::nullopt;
  return BoundaryAt(hit->mesh, hit->point.triangle, hit->distance_mm, Position(*meshes_[hit->mesh], hit->point),
                    normals_[hit->mesh][hit->point.triangle], medium);
}

int WalkScene::MediumOutside(int surface, const glm::dvec3& place, const glm::dvec3& normal) const {
  for (int above = surface - 1; above >= 0; --above) {
    const auto hit = caster_.NearestAccepted(place, normal, kFar, [&](int mesh, int) { return mesh == above; });
    if (hit && glm::dot(normals_[above][hit->point.triangle], normal) > 0) return above + 1;  // met from inside
  }
  return kOutside;
}

}  // namespace crownfit
