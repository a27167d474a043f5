#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/parallel.h"
#include "path/triangle_grid.h"

namespace crownfit {
namespace {

constexpr double kCubes = 64.0;   // along the longest side
constexpr double kNear_mm = 0.8;  // further from surfaces a lower bound is enough

}  // namespace

TriangleGrid::TriangleGrid(const std::vector<TriangleMesh>& surfaces,
                           const std::vector<std::vector<uint8_t>>& is_exposed, const glm::dvec3& low,
                           const glm::dvec3& high, int threads) {
  const glm::dvec3 size = high - low;
  cubes_.low = low;
  cubes_.per_mm = kCubes / std::max({size.x, size.y, size.z});
  cubes_.count = glm::ivec3(glm::ceil(size * cubes_.per_mm));
  FindDistances(surfaces, threads);
  ListFacets(GatherFacets(surfaces, is_exposed));
  FindSlabs();
}

void TriangleGrid::FindDistances(const std::vector<TriangleMesh>& surfaces, int threads) {
  std::vector<const TriangleMesh*> meshes;
  for (const TriangleMesh& mesh : surfaces) meshes.push_back(&mesh);
  const RayCaster caster(meshes);
  const double cube_mm = cubes_.cube_mm();
  const glm::dvec3 farthest = glm::abs(cubes_.low) + glm::dvec3(cubes_.count) * cube_mm;
  const double rounding = 1e-4 * cube_mm + 0x1p-22 * std::max({farthest.x, farthest.y, farthest.z});  // of queries
  const glm::ivec3 count = cubes_.count;
  distance_mm_.resize(static_cast<size_t>(count.x) * count.y * count.z);
  ParallelFor(static_cast<size_t>(count.y) * count.z, threads, [&](size_t row) {
    const int y = static_cast<int>(row % count.y), z = static_cast<int>(row / count.y);
    double d = kFar;  // distance from the cube before, or a lower bound of it
    bool is_exact = false;
    for (int x = 0; x < count.x; ++x) {
      d -= cube_mm;  // a distance changes by at most the step
      if (x == 0 || d < kNear_mm) {
        d = caster.DistanceToSurface(cubes_.middle({x, y, z}), is_exact ? d + 2.001 * cube_mm : kFar);
        is_exact = true;
      } else {
        is_exact = false;
      }
      distance_mm_[row * count.x + x] = static_cast<float>(d - rounding);
    }
  });
}

std::vector<TriangleGrid::Group> TriangleGrid::GatherFacets(const std::vector<TriangleMesh>& surfaces,
                                                            const std::vector<std::vector<uint8_t>>& is_exposed) {
  std::vector<Group> groups;
  for (size_t m = 0; m < surfaces.size(); ++m) {
    const TriangleMesh& mesh = surfaces[m];
    for (const bool exposed : {false, true}) {
      const size_t first = facets_.size();
      for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
        if ((!is_exposed[m].empty() && is_exposed[m][t]) != exposed) continue;
        const glm::ivec3 i = mesh.triangles[t];
        const glm::dvec3 &a = mesh.vertices[i.x], &b = mesh.vertices[i.y], &c = mesh.vertices[i.z],
                         cross = glm::cross(b - a, c - a);
        if (!(glm::length(cross) > 0)) continue;  // zero area: its neighbours close the surface
        facets_.push_back({glm::normalize(cross), {glm::vec3(a), glm::vec3(b), glm::vec3(c)}, t});
      }
      // Neighbours in space become neighbours in memory.
      const auto place = [&](const Facet& f) { return cubes_.number(cubes_.Nearest(glm::dvec3(f.corners[0]))); };
      std::stable_sort(facets_.begin() + static_cast<std::ptrdiff_t>(first), facets_.end(),
                       [&](const Facet& a, const Facet& b) { return place(a) < place(b); });
      const int inside = static_cast<int>(m) + 1;
      if (facets_.size() > first) groups.push_back({first, inside, exposed ? 0 : inside - 1});
    }
  }
  return groups;
}

void TriangleGrid::ListFacets(const std::vector<Group>& groups) {
  const double cube_mm = cubes_.cube_mm();
  const glm::dvec3 margin(kListed * cube_mm);
  // The first pass counts, the second fills. In every cube each group starts a new pack.
  std::vector<uint32_t> listed(distance_mm_.size());
  const auto list = [&](const auto& put) {
    std::fill(listed.begin(), listed.end(), 0);
    for (size_t g = 0; g < groups.size(); ++g) {
      const size_t end = g + 1 < groups.size() ? groups[g + 1].first : facets_.size();
      for (size_t i = groups[g].first; i < end; ++i) {
        const Facet& f = facets_[i];
        const auto [low, high] = f.Box();
        const glm::dvec3 n = glm::abs(f.normal);
        const double reach = cube_mm * ((0.5 + kListed) * (n.x + n.y + n.z) + kListed);
        cubes_.ForCubes(low - margin, high + margin, [&](size_t cube, const glm::dvec3& middle) {
          const double above = f.Above(middle);
          if (std::abs(above) <= reach) put(groups[g], i, cube, listed[cube]++, above);
        });
      }
      for (uint32_t& n : listed) n = (n + kPack - 1) / kPack * kPack;
    }
  };
  list([](const Group&, size_t, size_t, uint32_t, double) {});
  first_pack_.assign(listed.size() + 1, 0);
  for (size_t i = 0; i < listed.size(); ++i) first_pack_[i + 1] = first_pack_[i] + listed[i] / kPack;
  packs_.resize(first_pack_.back());
  for (Pack& pack : packs_) pack.offset.fill(std::numeric_limits<float>::infinity());
  list([&](const Group& group, size_t i, size_t cube, uint32_t n, double above) {
    Pack& pack = packs_[first_pack_[cube] + n / kPack];
    const uint32_t k = n % kPack;
    const glm::vec3 normal(facets_[i].normal);
    pack.nx[k] = normal.x, pack.ny[k] = normal.y, pack.nz[k] = normal.z;
    pack.offset[k] = static_cast<float>(above);
    pack.facet[k] = static_cast<int32_t>(i);
    pack.inside = group.inside, pack.outermost = group.outermost;
  });
}

void TriangleGrid::FindSlabs() {
  const double reach_mm = kReach * cubes_.cube_mm(), rounding = 1e-5 * cubes_.cube_mm();
  slabs_.resize(distance_mm_.size());
  // Calls visit for the cubes whose ball both the facet's box and its plane reach.
  const auto for_balls = [&](const Facet& f, const auto& visit) {
    glm::dvec3 low, high;  // no bindings: clang 14 captures none
    std::tie(low, high) = f.Box();
    cubes_.ForCubes(low - reach_mm, high + reach_mm, [&](size_t cube, const glm::dvec3& middle) {
      const double above = f.Above(middle);
      if (std::abs(above) < reach_mm && glm::distance(middle, glm::clamp(middle, low, high)) < reach_mm)
        visit(cube, middle, above);
    });
  };
  std::vector<glm::dvec3> normals(slabs_.size(), glm::dvec3(0.0));
  for (const Facet& f : facets_) {
    const glm::dvec3 a(f.corners[0]), b(f.corners[1]), c(f.corners[2]), area = glm::cross(b - a, c - a);
    for_balls(f, [&](size_t cube, const glm::dvec3&, double) { normals[cube] += area; });
  }
  for (size_t i = 0; i < slabs_.size(); ++i) {
    if (!(glm::length(normals[i]) > 0)) continue;
    const glm::vec3 n(glm::normalize(normals[i]));
    slabs_[i] = {n.x, n.y, n.z, std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  }
  for (const Facet& f : facets_)
    for_balls(f, [&](size_t cube, const glm::dvec3& middle, double above) {
      Slab& slab = slabs_[cube];
      const glm::dvec3 n(slab.nx, slab.ny, slab.nz);
      // Bounds of the facet by its corners, and of its plane's disk in the ball by the angle between the two normals.
      double low = kFar, high = -kFar;
      for (const glm::vec3& corner : f.corners) {
        const double d = glm::dot(n, glm::dvec3(corner) - middle);
        low = std::min(low, d), high = std::max(high, d);
      }
      const double cosine = glm::dot(n, f.normal), radius = std::sqrt(reach_mm * reach_mm - above * above),
                   tilt = radius * glm::length(n - cosine * f.normal);
      low = std::max(low, cosine * above - tilt), high = std::min(high, cosine * above + tilt);
      slab.low = std::min(slab.low, static_cast<float>(low - rounding));
      slab.high = std::max(slab.high, static_cast<float>(high + rounding));
    });
}

}  // namespace crownfit
