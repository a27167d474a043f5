#include "path/triangle_grid.h"

#include <algorithm>
#include <bit>

#include "path/vector_clones.h"

namespace crownfit {
namespace {

// In units of cubes:
constexpr double kNudge = 1e-6;     // overshoot of steps from cube to cube; facets are listed with a wider margin
constexpr double kHealed = 1e-8;    // rounding may have put a point this far behind a facet
constexpr float kGenerous = 4e-6f;  // single-precision rounding in the first test

/// Whether a line meets a triangle, edges and corners included. Signed volumes of a shared edge are computed with the
/// same numbers from both sides, so that no line passes between two triangles (Woop, Benthin and Wald 2013).
[[gnu::always_inline]] inline bool Meets(const glm::dvec3& o, const glm::dvec3& d,
                                         const std::array<glm::vec3, 3>& corners) {
  const glm::dvec3 a = glm::dvec3(corners[0]) - o, b = glm::dvec3(corners[1]) - o, c = glm::dvec3(corners[2]) - o;
  const double u = glm::dot(d, glm::cross(c, b)), v = glm::dot(d, glm::cross(a, c)), w = glm::dot(d, glm::cross(b, a));
  return (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
}

}  // namespace

void TriangleGrid::FindEnds(std::span<FacetFlight> flights) const {
  constexpr size_t kTogether = 64;
  for (size_t first = 0; first < flights.size(); first += kTogether)
    FindSomeEnds(flights.subspan(first, std::min(kTogether, flights.size() - first)));
}

/// The part of a flight that can meet surfaces, by the slab of its first cube.
std::pair<double, double> TriangleGrid::WithinSlab(const FacetFlight& f) const {
  const std::pair<double, double> all{0.0, f.max_mm};
  const glm::dvec3 p = cubes_.InCubes(f.origin);
  if (!cubes_.Holds(p)) return all;
  const glm::ivec3 cube(p);
  const Slab& slab = slabs_[cubes_.number(cube)];
  const glm::dvec3 a = (p - (glm::dvec3(cube) + 0.5)) * cubes_.cube_mm(), b = a + f.max_mm * f.direction,
                   n(slab.nx, slab.ny, slab.nz);
  if (!(glm::length(b) < kReach * cubes_.cube_mm())) return all;
  const double at = glm::dot(n, a), along = glm::dot(n, f.direction), one = (slab.low - at) / along,
               other = (slab.high - at) / along;
  if (!(std::abs(along) > 1e-9)) return all;
  return {std::max(0.0, std::min(one, other)), std::min(f.max_mm, std::max(one, other))};
}

/// Advances all flights from cube to cube together. Each step reads memory that the step before has prefetched.
CROWNFIT_FOR_EVERY_VECTOR
void TriangleGrid::FindSomeEnds(std::span<FacetFlight> flights) const {
  struct Place {
    FacetFlight* flight;
    glm::dvec3 inverse, ahead;  ///< 1 / direction; 1 where the direction is positive
    glm::dvec3 from_middle;
    double at_mm, end_mm;  ///< distances at which the flight enters and leaves the cube
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
  const double cube_mm = cubes_.cube_mm(), per_mm = cubes_.per_mm, nudge = kNudge * cube_mm,
               healed = -kHealed * cube_mm;
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
    places[count++] = {
        &f, 1.0 / (f.direction + 0.0), glm::step(glm::dvec3(0.0), f.direction), {}, from_mm, 0.0, until_mm, 0};
  }
  while (count > 0) {
    size_t inside_grid = 0;
    for (size_t i = 0; i < count; ++i) {
      const Place& place = places[i];
      const FacetFlight& f = *place.flight;
      const glm::dvec3 start = cubes_.InCubes(f.origin), p = start + place.at_mm * per_mm * f.direction;
      if (!cubes_.Holds(p)) continue;
      const glm::ivec3 at(p);
      const glm::dvec3 border = glm::dvec3(at) + place.ahead, ways = (border - start) * place.inverse;
      const double end = std::min(std::min(ways.x, ways.y), ways.z);
      const size_t cube = cubes_.number(at);
      __builtin_prefetch(&first_pack_[cube]);
      __builtin_prefetch(&distance_mm_[cube]);
      places[inside_grid++] = {place.flight,   place.inverse,
                               place.ahead,    (p - (glm::dvec3(at) + 0.5)) * cube_mm,
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
          // Ahead of the start and not beyond the end: both signs in one number.
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
