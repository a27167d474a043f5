#include "walk/facet_grid.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "base/parallel.h"
#include "geometry/ray_caster.h"
#include "walk/vector_clones.h"

namespace crownfit {
namespace {

constexpr double kCubes = 64.0;   // along the longest side
constexpr double kNear_mm = 0.8;  // further from surfaces a lower bound does
// In cubes:
constexpr double kNudge = 1e-6;     // steps from cube to cube go so much too far ...
constexpr double kListed = 4e-6;    // ... and facets are listed in cubes they miss by so much
constexpr double kHealed = 1e-8;    // rounding may have put a place so far beyond a facet
constexpr float kGenerous = 4e-6f;  // rounding of single precision in the first choice

/// Whether a line meets a triangle, edges and corners included: signed volumes, computed for a shared edge with the
/// same numbers from both sides, so that no line passes between two triangles (Woop, Benthin and Wald 2013).
[[gnu::always_inline]] inline bool Meets(const glm::dvec3& o, const glm::dvec3& d,
                                         const std::array<glm::vec3, 3>& corners) {
  const glm::dvec3 a = glm::dvec3(corners[0]) - o, b = glm::dvec3(corners[1]) - o, c = glm::dvec3(corners[2]) - o;
  const double u = glm::dot(d, glm::cross(c, b)), v = glm::dot(d, glm::cross(a, c)), w = glm::dot(d, glm::cross(b, a));
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

}  // namespace

FacetGrid::FacetGrid(const std::vector<TriangleMesh>& surfaces, const std::vector<std::vector<uint8_t>>& is_exposed,
                     const glm::dvec3& low, const glm::dvec3& high, int threads)
    : low_(low) {
  const glm::dvec3 size = high - low;
  const double cube_mm = std::max({size.x, size.y, size.z}) / kCubes;
  per_mm_ = 1.0 / cube_mm;
  count_ = glm::ivec3(glm::ceil(size * per_mm_));
  FindDistances(surfaces, threads);
  ListFacets(surfaces, is_exposed);
  FindSlabs();
}

void FacetGrid::FindDistances(const std::vector<TriangleMesh>& surfaces, int threads) {
  std::vector<const TriangleMesh*> meshes;
  for (const TriangleMesh& mesh : surfaces) meshes.push_back(&mesh);
  const RayCaster caster(meshes);
  const double cube_mm = 1.0 / per_mm_, rounding = 1e-4 * cube_mm;
  distance_mm_.resize(static_cast<size_t>(count_.x) * count_.y * count_.z);
  ParallelFor(static_cast<size_t>(count_.y) * count_.z, threads, [&](size_t row) {
    const size_t y = row % count_.y, z = row / count_.y;
    double d = kFar;  // distance from the cube before, or a lower bound of it
    bool is_exact = false;
    for (int x = 0; x < count_.x; ++x) {
      d -= cube_mm;  // a distance changes by no more than one moves
      if (x == 0 || d < kNear_mm) {
        const glm::dvec3 centre =
            low_ + (glm::dvec3(x, static_cast<double>(y), static_cast<double>(z)) + 0.5) * cube_mm;
        d = caster.DistanceToSurface(centre, is_exact ? d + 2.001 * cube_mm : kFar);
        is_exact = true;
      } else {
        is_exact = false;
      }
      distance_mm_[row * count_.x + x] = static_cast<float>(d - rounding);
    }
  });
}

void FacetGrid::ListFacets(const std::vector<TriangleMesh>& surfaces,
                           const std::vector<std::vector<uint8_t>>& is_exposed) {
  const double cube_mm = 1.0 / per_mm_;
  const auto cube_at = [&](const glm::dvec3& p, double margin) {
    return glm::clamp(glm::ivec3(glm::floor((p - low_) * per_mm_ + margin)), glm::ivec3(0), count_ - 1);
  };
  const auto number_of = [&](const glm::ivec3& c) {
    return (static_cast<size_t>(c.z) * count_.y + c.y) * count_.x + c.x;
  };
  const auto middle_of = [&](const glm::ivec3& c) { return low_ + (glm::dvec3(c) + 0.5) * cube_mm; };
  struct Group {
    size_t first;
    int inside, outermost;
  };
  std::vector<Group> groups;  // facets that bound the same media
  for (size_t m = 0; m < surfaces.size(); ++m) {
    const TriangleMesh& mesh = surfaces[m];
    for (const bool exposed : {false, true}) {
      const size_t first = facets_.size();
      for (int t = 0; t < static_cast<int>(mesh.triangles.size()); ++t) {
        if ((!is_exposed[m].empty() && is_exposed[m][t]) != exposed) continue;
        const glm::ivec3 i = mesh.triangles[t];
        const glm::dvec3 &a = mesh.vertices[i.x], &b = mesh.vertices[i.y], &c = mesh.vertices[i.z],
                         cross = glm::cross(b - a, c - a);
        if (!(glm::length(cross) > 0)) continue;  // without area: its neighbours close the surface
        facets_.push_back({glm::normalize(cross), {glm::vec3(a), glm::vec3(b), glm::vec3(c)}, t});
      }
      // Neighbours in space become neighbours in memory.
      const auto place = [&](const Facet& f) { return number_of(cube_at(glm::dvec3(f.corners[0]), 0.0)); };
      std::stable_sort(facets_.begin() + static_cast<std::ptrdiff_t>(first), facets_.end(),
                       [&](const Facet& a, const Facet& b) { return place(a) < place(b); });
      const int inside = static_cast<int>(m) + 1;
      if (facets_.size() > first) groups.push_back({first, inside, exposed ? 0 : inside - 1});
    }
  }
  // Cubes that a facet's box and its plane both reach.
  const auto for_cubes = [&](const Facet& f, const auto& visit) {
    const glm::dvec3 a(f.corners[0]), b(f.corners[1]), c(f.corners[2]), n = glm::abs(f.normal);
    const double reach = cube_mm * ((0.5 + kListed) * (n.x + n.y + n.z) + kListed), offset = glm::dot(f.normal, a);
    const glm::ivec3 from = cube_at(glm::min(glm::min(a, b), c), -kListed),
                     to = cube_at(glm::max(glm::max(a, b), c), kListed);
    for (int z = from.z; z <= to.z; ++z)
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) {
          const double above = offset - glm::dot(f.normal, middle_of({x, y, z}));
          if (std::abs(above) <= reach) visit(number_of({x, y, z}), above);
        }
  };
  // Once to count, once to fill. In every cube each group begins a pack of its own.
  std::vector<uint32_t> listed(distance_mm_.size());
  const auto list = [&](const auto& put) {
    std::fill(listed.begin(), listed.end(), 0);
    for (size_t g = 0; g < groups.size(); ++g) {
      const size_t end = g + 1 < groups.size() ? groups[g + 1].first : facets_.size();
      for (size_t i = groups[g].first; i < end; ++i)
        for_cubes(facets_[i], [&](size_t cube, double above) { put(groups[g], i, cube, listed[cube]++, above); });
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

void FacetGrid::FindSlabs() {
  const double cube_mm = 1.0 / per_mm_, reach_mm = kReach * cube_mm;
  slabs_.resize(distance_mm_.size());
  std::vector<glm::dvec3> normals(slabs_.size(), glm::dvec3(0.0));
  // Cubes whose ball the facet's box and plane both reach.
  const auto for_balls = [&](const Facet& f, const auto& visit) {
    const glm::dvec3 a(f.corners[0]), b(f.corners[1]), c(f.corners[2]), low = glm::min(glm::min(a, b), c),
                                                                        high = glm::max(glm::max(a, b), c);
    const auto clamped = [&](const glm::dvec3& p) {
      return glm::clamp(glm::ivec3(glm::floor((p - low_) * per_mm_)), glm::ivec3(0), count_ - 1);
    };
    const glm::ivec3 from = clamped(low - reach_mm), to = clamped(high + reach_mm);
    for (int z = from.z; z <= to.z; ++z)
      for (int y = from.y; y <= to.y; ++y)
        for (int x = from.x; x <= to.x; ++x) {
          const glm::dvec3 middle = low_ + (glm::dvec3(x, y, z) + 0.5) * cube_mm;
          const double above = glm::dot(f.normal, a - middle);
          if (std::abs(above) < reach_mm && glm::distance(middle, glm::clamp(middle, low, high)) < reach_mm)
            visit((static_cast<size_t>(z) * count_.y + y) * count_.x + x, middle, above);
        }
  };
  for (const Facet& f : facets_) {
    const glm::dvec3 a(f.corners[0]), b(f.corners[1]), c(f.corners[2]);
    const glm::dvec3 area = f.normal * glm::length(glm::cross(b - a, c - a));
    for_balls(f, [&](size_t cube, const glm::dvec3&, double) { normals[cube] += area; });
  }
  for (size_t i = 0; i < slabs_.size(); ++i) {
    const double length = glm::length(normals[i]);
    if (!(length > 0)) continue;
    normals[i] /= length;
    slabs_[i] = {static_cast<float>(normals[i].x), static_cast<float>(normals[i].y), static_cast<float>(normals[i].z),
                 std::numeric_limits<float>::max(), std::numeric_limits<float>::lowest()};
  }
  const double rounding = 1e-5 * cube_mm;
  for (const Facet& f : facets_)
    for_balls(f, [&](size_t cube, const glm::dvec3& middle, double above) {
      Slab& slab = slabs_[cube];
      const glm::dvec3 n(slab.nx, slab.ny, slab.nz);
      // Of the facet by its corners, of its plane's disk in the ball by the angle between the two normals.
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

void FacetGrid::FindEnds(std::span<FacetFlight> flights) const {
  constexpr size_t kTogether = 64;
  for (size_t first = 0; first < flights.size(); first += kTogether)
    FindSomeEnds(flights.subspan(first, std::min(kTogether, flights.size() - first)));
}

/// The part of a flight within which the surfaces lie, as far as the slab of its first cube tells.
std::pair<double, double> FacetGrid::WithinSlab(const FacetFlight& f) const {
  const std::pair<double, double> all{0.0, f.max_mm};
  const glm::dvec3 p = (f.origin - low_) * per_mm_;
  if (!(p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < count_.x && p.y < count_.y && p.z < count_.z)) return all;
  const glm::ivec3 cube(p);
  const Slab& slab = slabs_[(static_cast<size_t>(cube.z) * count_.y + cube.y) * count_.x + cube.x];
  const glm::dvec3 a = (p - (glm::dvec3(cube) + 0.5)) / per_mm_, b = a + f.max_mm * f.direction,
                   n(slab.nx, slab.ny, slab.nz);
  if (!(glm::dot(b, b) * per_mm_ * per_mm_ < kReach * kReach)) return all;
  const double at = glm::dot(n, a), along = glm::dot(n, f.direction), one = (slab.low - at) / along,
               other = (slab.high - at) / along;
  if (!(std::abs(along) > 1e-9)) return all;
  return {std::max(0.0, std::min(one, other)), std::min(f.max_mm, std::max(one, other))};
}

/// All flights go from cube to cube together, in steps that each read memory which the step before has called for.
CROWNFIT_FOR_EVERY_VECTOR
void FacetGrid::FindSomeEnds(std::span<FacetFlight> flights) const {
  struct Place {
    FacetFlight* flight;
    glm::dvec3 inverse, ahead;  ///< of the direction: 1 / it, 1 where it is positive
    glm::dvec3 from_middle;
    double at_mm, end_mm;  ///< of the way through the cube
    double until_mm;       ///< nothing is met beyond
    size_t cube;
  };
  struct Candidate {
    Place* place;
    const Facet* facet;
    int inside;
  };
  std::array<Place, 64> places;
  std::array<Candidate, 256> candidates;
  const double cube_mm = 1.0 / per_mm_, nudge = kNudge * cube_mm, healed = -kHealed * cube_mm;
  const float generous = kGenerous * static_cast<float>(cube_mm);
  const auto test = [&](const Candidate& c) {
    FacetFlight& f = *c.place->flight;
    const double along = glm::dot(c.facet->normal, f.direction);
    if (!(f.medium == c.inside ? along > 0 : along < 0)) return;
    const double away = glm::dot(c.facet->normal, glm::dvec3(c.facet->corners[0]) - f.origin) / along;
    if (!(away >= healed && away <= std::min(c.place->end_mm, c.place->until_mm) && away < f.distance_mm)) return;
    if (!Meets(f.origin, f.direction, c.facet->corners)) return;
    f.distance_mm = away;
    f.normal = c.facet->normal;
    f.mesh = c.inside - 1;
    f.triangle = c.facet->triangle;
  };
  size_t count = 0;
  for (FacetFlight& f : flights) {
    const auto [from_mm, until_mm] = WithinSlab(f);
    places[count++] = {&f, 1.0 / f.direction, glm::step(glm::dvec3(0.0), f.direction), {}, from_mm, 0.0, until_mm, 0};
  }
  while (count > 0) {
    size_t inside_grid = 0;
    for (size_t i = 0; i < count; ++i) {
      const Place& place = places[i];
      const FacetFlight& f = *place.flight;
      const glm::dvec3 start = (f.origin - low_) * per_mm_, p = start + place.at_mm * per_mm_ * f.direction;
      if (!(p.x >= 0 && p.y >= 0 && p.z >= 0 && p.x < count_.x && p.y < count_.y && p.z < count_.z)) continue;
      const int x = static_cast<int>(p.x), y = static_cast<int>(p.y), z = static_cast<int>(p.z);
      const glm::dvec3 border = glm::dvec3(x, y, z) + place.ahead, ways = (border - start) * place.inverse;
      const double end = std::min(std::min(ways.x, ways.y), ways.z);
      const size_t cube = (static_cast<size_t>(z) * count_.y + y) * count_.x + x;
      __builtin_prefetch(&first_pack_[cube]);
      __builtin_prefetch(&distance_mm_[cube]);
      places[inside_grid++] = {place.flight,   place.inverse,
                               place.ahead,    (p - glm::dvec3(x + 0.5, y + 0.5, z + 0.5)) * cube_mm,
                               place.at_mm,    std::max(place.at_mm, end * cube_mm) + nudge,
                               place.until_mm, cube};
    }
    count = inside_grid;
    for (size_t i = 0; i < count; ++i) {
      const char* pack = reinterpret_cast<const char*>(packs_.data() + first_pack_[places[i].cube]);
      for (size_t byte = 0; byte < sizeof(Pack); byte += 64) __builtin_prefetch(pack + byte);
    }
    size_t chosen = 0;
    for (size_t i = 0; i < count; ++i) {
      Place& place = places[i];
      const FacetFlight& f = *place.flight;
      const float dx = static_cast<float>(f.direction.x), dy = static_cast<float>(f.direction.y),
                  dz = static_cast<float>(f.direction.z), px = static_cast<float>(place.from_middle.x),
                  py = static_cast<float>(place.from_middle.y), pz = static_cast<float>(place.from_middle.z),
                  way = static_cast<float>(std::min(place.end_mm, place.until_mm) - place.at_mm);
      for (uint32_t n = first_pack_[place.cube]; n < first_pack_[place.cube + 1]; ++n) {
        const Pack& pack = packs_[n];
        const bool from_behind = f.medium == pack.inside;
        if (!from_behind && !(f.medium < pack.inside && f.medium >= pack.outermost)) continue;
        const float side = from_behind ? 1.0f : -1.0f;
        alignas(64) std::array<float, kPack> crossed;
#pragma GCC ivdep
        for (int k = 0; k < kPack; ++k) {
          const float along = side * (pack.nx[k] * dx + pack.ny[k] * dy + pack.nz[k] * dz);
          const float above = side * (pack.offset[k] - (pack.nx[k] * px + pack.ny[k] * py + pack.nz[k] * pz));
          // Ahead, and no farther than the way goes: both signs in one number.
          const float before = above + generous, beyond = along * way + generous - above;
          crossed[k] = before < beyond ? before : beyond;
        }
        uint32_t which = 0;
        for (int k = 0; k < kPack; ++k) which |= static_cast<uint32_t>(crossed[k] >= 0) << k;
        for (; which != 0; which &= which - 1) {
          const Candidate candidate{&place, &facets_[pack.facet[std::countr_zero(which)]], pack.inside};
          if (chosen == candidates.size()) {
            test(candidate);
          } else {
            __builtin_prefetch(candidate.facet);
            candidates[chosen++] = candidate;
          }
        }
      }
    }
    for (size_t i = 0; i < chosen; ++i) test(candidates[i]);
    size_t going_on = 0;
    for (size_t i = 0; i < count; ++i) {
      Place& place = places[i];
      FacetFlight& f = *place.flight;
      if (f.is_ended()) {
        f.distance_mm = std::max(0.0, f.distance_mm);
        continue;
      }
      const double clear = static_cast<double>(distance_mm_[place.cube]) - glm::length(place.from_middle);
      place.at_mm = std::max(place.end_mm, place.at_mm + clear);
      if (place.at_mm <= place.until_mm) places[going_on++] = place;
    }
    count = going_on;
  }
}

}  // namespace crownfit
