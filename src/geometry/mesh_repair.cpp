// Making a mesh a closed, outward-looking surface, or saying why it is none.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <unordered_map>

#include "base/error.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

struct DirectedEdges {
  std::vector<int> forward, backward;  ///< triangles that run through the edge from low to high index, and back
};

uint64_t EdgeKey(int a, int b) {
  return (static_cast<uint64_t>(std::min(a, b)) << 32) | static_cast<uint32_t>(std::max(a, b));
}

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

size_t OpenEdges(const std::unordered_map<uint64_t, DirectedEdges>& edges) {
  return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [](const auto& e) {
    return (e.second.forward.size() + e.second.backward.size()) % 2 != 0;
  }));
}

/// Merges vertices at exactly equal positions (STL has none shared; texture seams double them).
void Weld(TriangleMesh& mesh) {
  const auto less = [](const glm::dvec3& a, const glm::dvec3& b) {
    return a.x != b.x ? a.x < b.x : a.y != b.y ? a.y < b.y : a.z < b.z;
  };
  std::map<glm::dvec3, int, decltype(less)> index(less);
  TriangleMesh welded;
  for (const auto& [name, values] : mesh.vertex_properties) welded.vertex_properties[name];
  std::vector<int> target(mesh.vertices.size());
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const auto [slot, is_new] = index.try_emplace(mesh.vertices[i], static_cast<int>(welded.vertices.size()));
    if (is_new) {
      welded.vertices.push_back(mesh.vertices[i]);
      for (auto& [name, values] : welded.vertex_properties) values.push_back(mesh.vertex_properties[name][i]);
    }
    target[i] = slot->second;
  }
  for (const auto& t : mesh.triangles) welded.triangles.emplace_back(target[t.x], target[t.y], target[t.z]);
  mesh = std::move(welded);
}

/// Turns faces until neighbours agree; returns how many were turned.
size_t AgreeOnOrientation(TriangleMesh& mesh) {
  const auto edges = EdgesOf(mesh);
  const auto runs_forward = [&](int t, int a, int b) {
    const glm::ivec3& f = mesh.triangles[t];
    for (int k = 0; k < 3; ++k)
      if (f[k] == a && f[(k + 1) % 3] == b) return true;
    return false;
  };
  std::vector<char> seen(mesh.triangles.size(), 0);
  size_t turned = 0;
  for (size_t first = 0; first < mesh.triangles.size(); ++first) {
    if (seen[first]) continue;
    std::vector<int> component{static_cast<int>(first)};
    seen[first] = 1;
    for (size_t next = 0; next < component.size(); ++next) {
      const int t = component[next];
      for (int k = 0; k < 3; ++k) {
        const int a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3];
        const auto& edge = edges.at(EdgeKey(a, b));
        if (edge.forward.size() + edge.backward.size() != 2) continue;  // only a plain edge says who agrees with whom
        for (const auto* side : {&edge.forward, &edge.backward}) {
          for (int other : *side) {
            if (seen[other]) continue;
            seen[other] = 1;
            if (runs_forward(other, a, b)) {
              std::swap(mesh.triangles[other].y, mesh.triangles[other].z);
              ++turned;
            }
            component.push_back(other);
          }
        }
      }
    }
  }
  return turned;
}

}  // namespace

TriangleMesh ReadClosedSurface(const std::filesystem::path& file, std::vector<std::string>& messages) {
  TriangleMesh mesh = ReadMeshFile(file);
  const std::string name = file.filename().string();
  const auto [low, high] = Bounds(mesh);
  const double size_mm = glm::length(high - low);
  if (size_mm < 1.0 || size_mm > 200.0)
    throw InputError(file, "",
                     "the mesh is " + std::to_string(size_mm) + " mm across, which is not the size of a crown",
                     "Meshes are in millimetres; scale the mesh when it was exported in metres or inches.");
  if (OpenEdges(EdgesOf(mesh)) > 0) Weld(mesh);
  const size_t before = mesh.triangles.size();
  std::erase_if(mesh.triangles, [&](const glm::ivec3& t) {
    return t.x == t.y || t.y == t.z || t.z == t.x;  // what welding or a scanner's decimation collapsed
  });
  if (mesh.triangles.size() < before)
    messages.push_back(name + ": " + std::to_string(before - mesh.triangles.size()) +
                       " collapsed triangles were dropped");
  if (const size_t open = OpenEdges(EdgesOf(mesh)); open > 0)
    throw InputError(file, "", "the surface is not closed: " + std::to_string(open) + " open edges",
                     "Close the mesh (fill the holes and the neck) in the scanner's software or a mesh editor.");
  for (const glm::ivec3& t : mesh.triangles) {
    // A sliver without area has no normal; nudging is not needed as its neighbours cover the place.
    const glm::dvec3 n = glm::cross(mesh.vertices[t.y] - mesh.vertices[t.x], mesh.vertices[t.z] - mesh.vertices[t.x]);
    if (!(glm::length(n) > 0.0))
      throw InputError(file, "", "a triangle has no area but three different corners",
                       "Remove degenerate faces in a mesh editor (their normal is undefined).");
  }
  if (const size_t turned = AgreeOnOrientation(mesh); turned > 0)
    messages.push_back(name + ": " + std::to_string(turned) + " faces were turned to agree with their neighbours");
  if (Volume(mesh) < 0) {
    for (auto& t : mesh.triangles) std::swap(t.y, t.z);
    messages.push_back(name + ": the surface was inside out and has been turned");
  }
  return mesh;
}

}  // namespace crownfit
