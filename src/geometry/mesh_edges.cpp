#include "geometry/mesh_edges.h"

#include <numeric>
#include <tuple>

namespace crownfit {

std::unordered_map<uint64_t, DirectedEdges> EdgesOf(const TriangleMesh& mesh) {
  std::unordered_map<uint64_t, DirectedEdges> edges;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
      auto& edge = edges[EdgeKey(a, b)];
      (a < b ? edge.forward : edge.backward).push_back(static_cast<int>(t));
    }
  }
  return edges;
}

size_t OpenEdges(const TriangleMesh& mesh) {
  const auto edges = EdgesOf(mesh);
  return static_cast<size_t>(
      std::count_if(edges.begin(), edges.end(), [](const auto& e) { return e.second.count() % 2 != 0; }));
}

double AreaOf(const TriangleMesh& mesh, const glm::ivec3& t) {
  return 0.5 *
         glm::length(glm::cross(mesh.vertices[t.y] - mesh.vertices[t.x], mesh.vertices[t.z] - mesh.vertices[t.x]));
}

std::vector<int> RanksByPosition(const TriangleMesh& mesh) {
  std::vector<int> order(mesh.vertices.size()), ranks(order.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const glm::dvec3 &p = mesh.vertices[a], &q = mesh.vertices[b];
    return p != q ? std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z) : a < b;
  });
  for (size_t i = 0; i < order.size(); ++i) ranks[order[i]] = static_cast<int>(i);
  return ranks;
}

size_t DropLooseVertices(TriangleMesh& mesh) {
  std::vector<int> target(mesh.vertices.size(), -1);
  for (const auto& t : mesh.triangles) target[t.x] = target[t.y] = target[t.z] = 0;
  const auto keep_used = [&](auto& values) {
    size_t kept = 0;
    for (size_t i = 0; i < target.size(); ++i)
      if (target[i] >= 0) values[kept++] = values[i];
    values.resize(kept);
  };
  const size_t before = mesh.vertices.size();
  keep_used(mesh.vertices);
  for (auto& [name, values] : mesh.vertex_properties) keep_used(values);
  int next = 0;
  for (int& t : target)
    if (t >= 0) t = next++;
  for (auto& t : mesh.triangles) t = {target[t.x], target[t.y], target[t.z]};
  return before - mesh.vertices.size();
}

}  // namespace crownfit
