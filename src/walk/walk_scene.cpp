#include "walk/walk_scene.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/parallel.h"
#include "geometry/signed_distance.h"

namespace crownfit {
namespace {

constexpr double kCubes = 64.0;   // along the longest side
constexpr double kNear_mm = 0.8;  // further from surfaces a lower bound does

}  // namespace

Clearance::Clearance(const RayCaster& layers, const glm::dvec3& low, const glm::dvec3& high, int threads) : low_(low) {
  const glm::dvec3 size = high - low;
  const double cube_mm = std::max({size.x, size.y, size.z}) / kCubes;
  per_mm_ = 1.0 / cube_mm;
  count_ = glm::ivec3(glm::ceil(size * per_mm_));
  distance_mm_.resize(static_cast<size_t>(count_.x) * count_.y * count_.z);
  const double rounding = 1e-4 * cube_mm;
  ParallelFor(static_cast<size_t>(count_.y) * count_.z, threads, [&](size_t row) {
    const size_t y = row % count_.y, z = row / count_.y;
    double d = kFar;  // distance from the cube before, or a lower bound of it
    bool is_exact = false;
    for (int x = 0; x < count_.x; ++x) {
      // A distance changes by no more than one moves.
      if (is_exact || d < kFar) d -= cube_mm;
      if (x == 0 || d < kNear_mm) {
        const glm::dvec3 centre =
            low_ + (glm::dvec3(x, static_cast<double>(y), static_cast<double>(z)) + 0.5) * cube_mm;
        d = layers.DistanceToSurface(centre, is_exact ? d + 2.001 * cube_mm : kFar);
        is_exact = true;
      } else {
        is_exact = false;
      }
      distance_mm_[row * count_.x + x] = static_cast<float>(d - rounding);
    }
  });
}

LayeredBody::LayeredBody(std::vector<TriangleMesh> layer_surfaces, int threads,
                         std::vector<std::shared_ptr<const AbsorptionTexture>> textures)
    : surfaces(std::move(layer_surfaces)), absorption(std::move(textures)) {
  absorption.resize(surfaces.size());
  std::tie(low, high) = Bounds(surfaces[0]);
  std::vector<const TriangleMesh*> meshes;
  for (const auto& mesh : surfaces) {
    meshes.push_back(&mesh);
    const auto [a, b] = Bounds(mesh);
    low = glm::min(low, a), high = glm::max(high, b);
  }
  const glm::dvec3 rounding(1e-5 * glm::length(high - low));
  low -= rounding, high += rounding;
  clearance = Clearance(RayCaster(meshes), low, high, threads);

  is_exposed.resize(surfaces.size());
  for (size_t i = 1; i < surfaces.size(); ++i) {
    const TriangleMesh &mesh = surfaces[i], &above = surfaces[i - 1];
    const RayCaster caster({&above});
    std::vector<uint8_t> is_deep(mesh.vertices.size());  // inside the layer above by more than the edges around it
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

bool WalkScene::Counts(int mesh, int triangle, const glm::dvec3& direction, int medium, const Boundary* left) const {
  if (mesh >= layers_)
    return medium == kOutside && !(left && left->opaque == mesh - layers_ && left->triangle == triangle);
  const double along = glm::dot(normals_[mesh][triangle], direction);
  if (along > 0) return medium == mesh + 1;
  return along < 0 && (medium == mesh || (medium < mesh && body_.is_exposed[mesh][triangle]));
}

Boundary WalkScene::BoundaryAt(const Hit& hit, int medium) const {
  const glm::dvec3 position = Position(*meshes_[hit.mesh], hit.point), normal = normals_[hit.mesh][hit.point.triangle];
  const int triangle = hit.point.triangle;
  if (hit.mesh >= layers_) return {hit.distance_mm, position, normal, kOutside, kOutside, hit.mesh - layers_, triangle};
  Boundary boundary{hit.distance_mm, position, normal,   hit.mesh + 1,
                    hit.mesh,        -1,       triangle, body_.surfaces[hit.mesh].cut(triangle)};
  if (hit.mesh > 0 && body_.is_exposed[hit.mesh][triangle])
    boundary.outside = medium <= hit.mesh ? medium : MediumOutside(hit.mesh, position, normal);
  return boundary;
}

std::optional<Boundary> WalkScene::Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium,
                                        double max_mm, const Boundary* left) const {
  if (medium != kOutside && max_mm < kFar) {
    // A surface on the way would be no farther from both ends together than the flight is long.
    const double from_here = body_.clearance.At(origin);
    if (max_mm < from_here || max_mm < from_here + body_.clearance.At(origin + max_mm * direction)) return std::nullopt;
  }
  const auto hit = caster_.NearestAccepted(origin, direction, max_mm, [&](int mesh, int triangle) {
    return Counts(mesh, triangle, direction, medium, left);
  });
  if (!hit) return std::nullopt;
  return BoundaryAt(*hit, medium);
}

void WalkScene::NextOfMany(std::span<const Ray> flights, std::span<const int> media,
                           std::span<std::optional<Boundary>> boundaries) const {
  std::vector<std::optional<Hit>> hits(flights.size());
  caster_.NearestAccepted(
      flights,
      [&](int i, int mesh, int triangle) { return Counts(mesh, triangle, flights[i].direction, media[i], nullptr); },
      hits);
  for (size_t i = 0; i < flights.size(); ++i) {
    boundaries[i].reset();
    if (hits[i]) boundaries[i] = BoundaryAt(*hits[i], media[i]);
  }
}

int WalkScene::MediumOutside(int surface, const glm::dvec3& place, const glm::dvec3& normal) const {
  for (int above = surface - 1; above >= 0; --above) {
    const auto hit = caster_.NearestAccepted(place, normal, kFar, [&](int mesh, int) { return mesh == above; });
    if (hit && glm::dot(normals_[above][hit->point.triangle], normal) > 0) return above + 1;  // met from inside
  }
  return kOutside;
}

}  // namespace crownfit
