// Cracks without width: corners of a fine neighbour that lie on an edge of a coarse one (T-vertices) become its corners
// too. A fan over such a crack would have no area, and so no normal.

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "base/text.h"
#include "geometry/mesh_edges.h"

namespace crownfit {
namespace {

/// Whether `p` lies within a distance of the edge from `a` to `b`, away from its ends, where welding would reach it.
bool LiesOnEdge(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b, double within_mm, double rounding_mm) {
  constexpr double kBend = 0.02;  // radians by which the edge may bend at the corner
  const glm::dvec3 edge = b - a;
  const double along = glm::dot(p - a, edge) / glm::dot(edge, edge);
  if (!(along > 0 && along < 1)) return false;
  const double to_end_mm = std::min(along, 1 - along) * glm::length(edge);
  return to_end_mm > rounding_mm && glm::distance(p, a + along * edge) <= std::min(within_mm, kBend * to_end_mm);
}

/// Vertices in a k-d tree, which finds those near a line.
class VerticesNearLines {
 public:
  VerticesNearLines(const std::vector<glm::dvec3>& places, std::vector<int> vertices)
      : places_(places), order_(std::move(vertices)) {
    Sort(0, order_.size(), 0);
  }

  /// Visits at least all vertices within a distance of the line from `a` to `b`.
  template <class Visit>
  void Near(const glm::dvec3& a, const glm::dvec3& b, double within_mm, const Visit& visit) const {
    Near(0, order_.size(), 0, a, b, within_mm, visit);
  }

 private:
  static constexpr size_t kLeaf = 8;

  void Sort(size_t begin, size_t end, int axis) {
    if (end - begin <= kLeaf) return;
    const size_t middle = (begin + end) / 2;
    const auto at = [&](size_t i) { return order_.begin() + static_cast<long>(i); };
    std::nth_element(at(begin), at(middle), at(end), [&](int p, int q) { return places_[p][axis] < places_[q][axis]; });
    Sort(begin, middle, (axis + 1) % 3);
    Sort(middle + 1, end, (axis + 1) % 3);
  }

  template <class Visit>
  void Near(size_t begin, size_t end, int axis, const glm::dvec3& a, const glm::dvec3& b, double within_mm,
            const Visit& visit) const {
    if (end - begin <= kLeaf) {
      for (size_t i = begin; i < end; ++i) visit(order_[i]);
      return;
    }
    const size_t middle = (begin + end) / 2;
    visit(order_[middle]);
    const double low = places_[order_[middle]][axis] - within_mm, high = places_[order_[middle]][axis] + within_mm;
    const auto cut_at = [&](double x) { return a + (x - a[axis]) / (b[axis] - a[axis]) * (b - a); };
    const bool a_is_low = a[axis] <= high, b_is_low = b[axis] <= high;
    if (a_is_low || b_is_low)
      Near(begin, middle, (axis + 1) % 3, a_is_low ? a : cut_at(high), b_is_low ? b : cut_at(high), within_mm, visit);
    const bool a_is_high = a[axis] >= low, b_is_high = b[axis] >= low;
    if (a_is_high || b_is_high)
      Near(middle + 1, end, (axis + 1) % 3, a_is_high ? a : cut_at(low), b_is_high ? b : cut_at(low), within_mm, visit);
  }

  const std::vector<glm::dvec3>& places_;
  std::vector<int> order_;
};

/// Cuts a triangle from corners on its edges to the corners opposite, the longest edge near its middle first.
/// `on[k]` are those on the edge from corner k to the next, in this order.
struct TriangleCutter {
  const TriangleMesh& mesh;
  const std::vector<int>& ranks;
  std::vector<glm::ivec3>& triangles;

  void Cut(const glm::ivec3& t, const std::array<std::vector<int>, 3>& on) const {
    const auto length = [&](int p, int q) { return glm::distance(mesh.vertices[p], mesh.vertices[q]); };
    int longest = -1;
    std::pair<double, int> most;
    for (int k = 0; k < 3; ++k) {
      const std::pair size{length(t[k], t[(k + 1) % 3]), ranks[t[(k + 2) % 3]]};
      if (!on[k].empty() && (longest < 0 || size > most)) longest = k, most = size;
    }
    if (longest < 0) {
      triangles.push_back(t);
      return;
    }
    const int a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3];
    const auto& here = on[longest];
    const auto unevenness = [&](int v) { return std::pair{std::max(length(a, v), length(v, b)), ranks[v]}; };
    const auto cut =
        std::min_element(here.begin(), here.end(), [&](int v, int w) { return unevenness(v) < unevenness(w); });
    Cut({a, *cut, c}, {std::vector<int>(here.begin(), cut), {}, on[(longest + 2) % 3]});
    Cut({*cut, b, c}, {std::vector<int>(cut + 1, here.end()), on[(longest + 1) % 3], {}});
  }
};

/// Takes out triangles with a corner on their own edge, which some exporters put over a crack. Returns how many.
size_t DropCrackCovers(TriangleMesh& mesh, double rounding_mm) {
  const auto edges = EdgesOf(mesh);
  return std::erase_if(mesh.triangles, [&](const glm::ivec3& t) {
    bool is_flat = false;
    for (int k = 0; k < 3; ++k) {
      if (edges.at(EdgeKey(t[k], t[(k + 1) % 3])).count() % 2 != 0) return false;  // it hangs on the surface
      is_flat |= LiesOnEdge(mesh.vertices[t[(k + 2) % 3]], mesh.vertices[t[k]], mesh.vertices[t[(k + 1) % 3]],
                            rounding_mm, rounding_mm);
    }
    return is_flat;
  });
}

}  // namespace

void SplitAtCorners(TriangleMesh& mesh, double rounding_mm, const std::string& name,
                    std::vector<std::string>& messages) {
  constexpr double kRoundings = 10;  // more than welding reaches, since no corner moves
  const double within_mm = kRoundings * rounding_mm;
  if (const size_t covers = DropCrackCovers(mesh, rounding_mm); covers > 0)
    messages.push_back(Printed("%s: %zu triangle%s without area removed", name.c_str(), covers, covers > 1 ? "s" : ""));
  std::vector<std::pair<int, int>> open;
  std::set<int> ends;
  for (const auto& [key, edge] : EdgesOf(mesh)) {
    if (edge.count() % 2 == 0) continue;
    open.emplace_back(static_cast<int>(key >> 32), static_cast<int>(key & 0xffffffffu));
    ends.insert({open.back().first, open.back().second});
  }
  const std::vector<int> ranks = RanksByPosition(mesh);
  const VerticesNearLines vertices(mesh.vertices, {ends.begin(), ends.end()});
  std::map<uint64_t, std::vector<int>> corners_on;  // from the edge's low end to its high one
  std::set<int> met;
  for (const auto& edge : open) {
    const int low = edge.first, high = edge.second;
    const glm::dvec3 &a = mesh.vertices[low], &b = mesh.vertices[high];
    std::vector<int> here;
    vertices.Near(a, b, within_mm, [&](int v) {
      if (v != low && v != high && LiesOnEdge(mesh.vertices[v], a, b, within_mm, rounding_mm)) here.push_back(v);
    });
    if (here.empty()) continue;
    const auto place = [&](int v) { return std::pair{glm::dot(mesh.vertices[v] - a, b - a), ranks[v]}; };
    std::sort(here.begin(), here.end(), [&](int v, int w) { return place(v) < place(w); });
    met.insert(here.begin(), here.end());
    corners_on[EdgeKey(low, high)] = std::move(here);
  }
  if (met.empty()) return;
  std::vector<glm::ivec3> triangles;
  const TriangleCutter cutter{mesh, ranks, triangles};
  for (const glm::ivec3& t : mesh.triangles) {
    std::array<std::vector<int>, 3> on;
    for (int k = 0; k < 3; ++k) {
      const auto found = corners_on.find(EdgeKey(t[k], t[(k + 1) % 3]));
      if (found == corners_on.end()) continue;
      on[k] = found->second;
      std::erase(on[k], t[(k + 2) % 3]);  // of a sliver
      if (t[k] > t[(k + 1) % 3]) std::reverse(on[k].begin(), on[k].end());
    }
    cutter.Cut(t, on);
  }
  mesh.triangles = std::move(triangles);
  messages.push_back(Printed("%s: %zu corner%s lay on a neighbour's edge, which was split there", name.c_str(),
                             met.size(), met.size() > 1 ? "s" : ""));
}

}  // namespace crownfit
