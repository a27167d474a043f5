#include "geometry/polygon.h"

#include <algorithm>
#include <cmath>

#include "geometry/triangle_mesh.h"

namespace crownfit {
namespace {

/// Twice the signed area of a triangle.
double Turn(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Whether two segments cross at a point inside both. Segments that touch do not: polygons with a hole run along a
/// bridge twice.
bool Cross(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c, const glm::dvec2& d, double least) {
  const auto differ = [&](double s, double t) { return (s > least && t < -least) || (s < -least && t > least); };
  return differ(Turn(a, b, c), Turn(a, b, d)) && differ(Turn(c, d, a), Turn(c, d, b));
}

/// In the plane of the Newell normal, which looks at the viewer; empty where the polygon has no area.
std::vector<glm::dvec2> Flattened(const std::vector<glm::dvec3>& corners) {
  glm::dvec3 normal(0.0);
  for (size_t i = 0; i < corners.size(); ++i)
    normal += glm::cross(corners[i] - corners[0], corners[(i + 1) % corners.size()] - corners[0]);
  if (!(glm::length(normal) > 0)) return {};
  const auto [u, v] = Tangents(glm::normalize(normal));
  std::vector<glm::dvec2> flat;
  for (const glm::dvec3& p : corners) flat.emplace_back(glm::dot(p - corners[0], u), glm::dot(p - corners[0], v));
  return flat;
}

/// Whether `b` lies between `a` and `c` on their line, as closely as files round.
bool IsStraight(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  constexpr double kRounding = 1e-3;  // radians
  return std::abs(Turn(a, b, c)) <= kRounding * glm::length(b - a) * glm::length(c - b) && glm::dot(b - a, c - b) > 0;
}

struct Clipper {
  const std::vector<glm::dvec3>& corners;
  std::vector<glm::dvec2> flat;
  double least;                 ///< an area of rounding
  std::vector<int> left;        ///< corners not cut off yet
  std::vector<int> blunt{};     ///< of those, the ones that are reflex or straight: no other can lie in an ear
  std::vector<int> straight{};  ///< and those that are straight up to rounding

  int at(int i) const { return left[(i + static_cast<int>(left.size())) % static_cast<int>(left.size())]; }

  /// Whether the triangle at the i-th corner lies inside the polygon and holds no other corner, not even on its rim.
  bool IsEar(int i) const {
    const glm::dvec2 &a = flat[at(i - 1)], &b = flat[at(i)], &c = flat[at(i + 1)];
    if (!(Turn(a, b, c) > least)) return false;
    return std::none_of(blunt.begin(), blunt.end(), [&](int k) {
      const glm::dvec2& p = flat[k];
      if (p == a || p == b || p == c) return false;
      return Turn(a, b, p) >= -least && Turn(b, c, p) >= -least && Turn(c, a, p) >= -least;
    });
  }

  void FindBlunt() {
    blunt.clear();
    straight.clear();
    for (int i = 0; i < static_cast<int>(left.size()); ++i) {
      const glm::dvec2 &a = flat[at(i - 1)], &b = flat[at(i)], &c = flat[at(i + 1)];
      if (!(Turn(a, b, c) > least)) blunt.push_back(at(i));
      if (IsStraight(a, b, c)) straight.push_back(at(i));
    }
  }

  /// Whether cutting an ear makes a sliver of a corner on a straight edge: of this one, or of one on the new edge.
  bool LeavesSliver(int i) const {
    const int a = at(i - 1), b = at(i), c = at(i + 1);
    return std::any_of(straight.begin(), straight.end(),
                       [&](int k) { return k == b || (k != a && k != c && IsStraight(flat[a], flat[k], flat[c])); });
  }

  /// Squared length of the edge that cutting makes.
  double NewEdge(int i) const {
    const glm::dvec3 edge = corners[at(i + 1)] - corners[at(i - 1)];
    return glm::dot(edge, edge);
  }
};

bool CrossesItself(const std::vector<glm::dvec2>& p, double least) {
  const size_t n = p.size();
  for (size_t i = 0; i < n; ++i)
    for (size_t k = i + 2; k < n; ++k)
      if (!(i == 0 && k == n - 1) && Cross(p[i], p[i + 1], p[k], p[(k + 1) % n], least)) return true;
  return false;
}

}  // namespace

std::optional<std::vector<std::array<int, 3>>> Triangulated(const std::vector<glm::dvec3>& corners) {
  const int count = static_cast<int>(corners.size());
  if (count == 3) return {{{0, 1, 2}}};
  std::vector<std::array<int, 3>> triangles;
  std::vector<int> kept;
  for (int i = 0; i < count; ++i) {
    if (corners[i] == corners[(i + 1) % count])
      triangles.push_back({i, i, (i + 1) % count});
    else
      kept.push_back(i);
  }
  if (kept.size() < 3) return triangles;
  if (kept.size() == 3) {
    triangles.push_back({kept[0], kept[1], kept[2]});
    return triangles;
  }
  std::vector<glm::dvec2> flat = Flattened(corners);
  if (flat.empty()) return std::nullopt;
  double size = 0;
  for (const glm::dvec2& p : flat) size = std::max({size, std::abs(p.x), std::abs(p.y)});
  const double least = 1e-12 * size * size;
  std::vector<glm::dvec2> outline;
  for (const int k : kept) outline.push_back(flat[k]);
  if (CrossesItself(outline, least)) return std::nullopt;
  Clipper clipper{corners, std::move(flat), least, std::move(kept)};
  while (clipper.left.size() > 3) {
    clipper.FindBlunt();
    // Of equal ones, as in a rectangle, the first after corner 0: a fan.
    constexpr double kShorter = 1 - 1e-6;
    int best = -1;
    bool best_leaves_sliver = true;
    const int n = static_cast<int>(clipper.left.size());
    for (int i = 1; i <= n; ++i) {
      if (!clipper.IsEar(i % n)) continue;
      const bool leaves_sliver = clipper.LeavesSliver(i % n);
      if (best < 0 || (leaves_sliver == best_leaves_sliver ? clipper.NewEdge(i % n) < kShorter * clipper.NewEdge(best)
                                                           : best_leaves_sliver))
        best = i % n, best_leaves_sliver = leaves_sliver;
    }
    if (best < 0) return std::nullopt;
    triangles.push_back({clipper.at(best - 1), clipper.at(best), clipper.at(best + 1)});
    clipper.left.erase(clipper.left.begin() + best);
  }
  if (!(Turn(clipper.flat[clipper.at(0)], clipper.flat[clipper.at(1)], clipper.flat[clipper.at(2)]) > 0))
    return std::nullopt;
  triangles.push_back({clipper.at(0), clipper.at(1), clipper.at(2)});
  return triangles;
}

}  // namespace crownfit
