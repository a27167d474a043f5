// Corners at one place become one vertex, faces that are there twice become one.

#include <array>
#include <cmath>
#include <map>
#include <numeric>

#include "base/text.h"
#include "geometry/mesh_edges.h"

namespace crownfit {
namespace {

/// Pairs of vertices at equal positions, or within a distance that is not 0.
template <class Visit>
void ForEachPairWithin(const TriangleMesh& mesh, const std::vector<int>& order, double within_mm, const Visit& visit) {
  if (within_mm == 0) {
    for (size_t i = 1; i < order.size(); ++i)
      if (mesh.vertices[order[i]] == mesh.vertices[order[i - 1]]) visit(order[i - 1], order[i]);
    return;
  }
  std::map<std::array<int64_t, 3>, std::vector<int>> cells;
  for (const int v : order) {
    const glm::dvec3& p = mesh.vertices[v];
    const auto cell = [&](int axis, int step) { return static_cast<int64_t>(std::floor(p[axis] / within_mm)) + step; };
    for (int n = 0; n < 27; ++n)
      if (const auto near = cells.find({cell(0, n % 3 - 1), cell(1, n / 3 % 3 - 1), cell(2, n / 9 - 1)});
          near != cells.end())
        for (const int other : near->second)
          if (glm::distance(p, mesh.vertices[other]) <= within_mm) visit(other, v);
    cells[{cell(0, 0), cell(1, 0), cell(2, 0)}].push_back(v);
  }
}

/// Of every vertex the one that stands for all within `within_mm` of it, of their neighbours, and so on; 0: at equal
/// positions. The lowest position stands for the others.
std::vector<int> StandIns(const TriangleMesh& mesh, double within_mm) {
  const std::vector<int> ranks = RanksByPosition(mesh);
  std::vector<int> order(ranks.size()), parent(ranks.size());
  for (size_t v = 0; v < ranks.size(); ++v) order[ranks[v]] = static_cast<int>(v);
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  ForEachPairWithin(mesh, order, within_mm, [&](int a, int b) {
    a = root(a), b = root(b);
    if (a != b) parent[ranks[a] < ranks[b] ? b : a] = ranks[a] < ranks[b] ? a : b;
  });
  for (size_t v = 0; v < parent.size(); ++v) parent[v] = root(static_cast<int>(v));
  return parent;
}

/// Returns how many vertices lost their place.
size_t Weld(TriangleMesh& mesh, double within_mm) {
  const std::vector<int> stand_in = StandIns(mesh, within_mm);
  for (auto& t : mesh.triangles) t = {stand_in[t.x], stand_in[t.y], stand_in[t.z]};
  size_t moved = 0;
  for (size_t v = 0; v < stand_in.size(); ++v) moved += mesh.vertices[v] != mesh.vertices[stand_in[v]];
  return moved;
}

struct Removed {
  size_t count = 0;
  double area_mm2 = 0;
};

/// Leaves one of the faces between the same corners; `was_repeated` marks it.
Removed DropSecondCopies(TriangleMesh& mesh, std::vector<char>& was_repeated) {
  const std::vector<int> stand_in = StandIns(mesh, 0);
  std::map<std::array<int, 3>, size_t> seen;
  std::vector<glm::ivec3> kept;
  Removed removed;
  was_repeated.clear();
  for (const glm::ivec3& t : mesh.triangles) {
    std::array<int, 3> corners{stand_in[t.x], stand_in[t.y], stand_in[t.z]};
    std::sort(corners.begin(), corners.end());
    const bool has_collapsed = corners[0] == corners[1] || corners[1] == corners[2];
    const auto [at, is_new] = seen.emplace(corners, kept.size());
    if (is_new || has_collapsed) {
      kept.push_back(t);
      was_repeated.push_back(0);
      continue;
    }
    was_repeated[at->second] = 1;
    ++removed.count;
    removed.area_mm2 += AreaOf(mesh, t);
  }
  mesh.triangles = std::move(kept);
  return removed;
}

/// Takes out walls between bodies that touch: patches of faces that were there twice and at whose rim three faces meet
/// now. Without the wall the bodies are one.
Removed DropInnerWalls(TriangleMesh& mesh, const std::vector<char>& was_repeated) {
  TriangleMesh welded = mesh;
  Weld(welded, 0);
  const auto edges = EdgesOf(welded);
  const auto faces_at = [&](int t, int k) {
    const DirectedEdges& edge = edges.at(EdgeKey(welded.triangles[t][k], welded.triangles[t][(k + 1) % 3]));
    std::vector<int> faces = edge.forward;
    faces.insert(faces.end(), edge.backward.begin(), edge.backward.end());
    return faces;
  };
  std::vector<char> seen(mesh.triangles.size(), 0), is_wall(mesh.triangles.size(), 0);
  Removed removed;
  for (size_t first = 0; first < seen.size(); ++first) {
    if (!was_repeated[first] || seen[first]) continue;
    std::vector<int> patch{static_cast<int>(first)};
    seen[first] = 1;
    bool has_walls_rim = false;
    for (size_t next = 0; next < patch.size(); ++next)
      for (int k = 0; k < 3; ++k) {
        const std::vector<int> faces = faces_at(patch[next], k);
        has_walls_rim |= faces.size() == 3;
        for (const int other : faces)
          if (faces.size() == 2 && was_repeated[other] && !seen[other]) seen[other] = 1, patch.push_back(other);
      }
    if (!has_walls_rim) continue;
    for (const int t : patch) is_wall[t] = 1, ++removed.count, removed.area_mm2 += AreaOf(mesh, mesh.triangles[t]);
  }
  std::vector<glm::ivec3> kept;
  for (size_t t = 0; t < is_wall.size(); ++t)
    if (!is_wall[t]) kept.push_back(mesh.triangles[t]);
  mesh.triangles = std::move(kept);
  return removed;
}

/// Takes out what welding or a scanner's decimation collapsed; returns how many triangles.
size_t DropCollapsed(TriangleMesh& mesh) {
  return std::erase_if(mesh.triangles, [](const glm::ivec3& t) { return t.x == t.y || t.y == t.z || t.z == t.x; });
}

}  // namespace

size_t WeldSeams(TriangleMesh& mesh, double rounding_mm, const std::string& name, std::vector<std::string>& messages) {
  if (OpenEdges(mesh) == 0) return 0;
  Weld(mesh, 0);
  const size_t collapsed = DropCollapsed(mesh), open = OpenEdges(mesh);
  if (open == 0) return collapsed;
  TriangleMesh closer = mesh;
  const size_t moved = Weld(closer, rounding_mm), collapsed_now = DropCollapsed(closer);
  if (OpenEdges(closer) >= open) return collapsed;
  mesh = std::move(closer);
  messages.push_back(
      Printed("%s: %zu corners within %.1g mm of others were merged with them", name.c_str(), moved, rounding_mm));
  return collapsed + collapsed_now;
}

void DropRepeatedFaces(TriangleMesh& mesh, const std::string& name, std::vector<std::string>& messages) {
  std::vector<char> was_repeated;
  const Removed repeated = DropSecondCopies(mesh, was_repeated);
  if (repeated.count == 0) return;
  messages.push_back(
      Printed("%s: %zu duplicate faces were removed (%.3g mm2)", name.c_str(), repeated.count, repeated.area_mm2));
  if (const Removed walls = DropInnerWalls(mesh, was_repeated); walls.count > 0)
    messages.push_back(Printed("%s: bodies touch in %zu faces, which were removed (%.3g mm2): they count as one body",
                               name.c_str(), walls.count, walls.area_mm2));
}

}  // namespace crownfit
