// Making a mesh a closed, outward-looking surface, or saying why it is none.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numeric>
#include <set>
#include <unordered_map>

#include "base/error.h"
#include "base/text.h"
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

double AreaOf(const TriangleMesh& mesh, size_t first_triangle) {
  double sum = 0;
  for (size_t t = first_triangle; t < mesh.triangles.size(); ++t) {
    const glm::ivec3& f = mesh.triangles[t];
    sum +=
        0.5 * glm::length(glm::cross(mesh.vertices[f.y] - mesh.vertices[f.x], mesh.vertices[f.z] - mesh.vertices[f.x]));
  }
  return sum;
}

/// The loops in which the surface ends, each running the way that the triangles which close it must run.
std::vector<std::vector<int>> Openings(const TriangleMesh& mesh) {
  std::multimap<int, int> onward;  // ordered, so that the same file gives the same loops
  for (const auto& [key, edge] : EdgesOf(mesh)) {
    const int low = static_cast<int>(key >> 32), high = static_cast<int>(key & 0xffffffffu);
    for (size_t k = edge.backward.size(); k < edge.forward.size(); ++k) onward.emplace(high, low);
    for (size_t k = edge.forward.size(); k < edge.backward.size(); ++k) onward.emplace(low, high);
  }
  std::vector<std::vector<int>> loops;
  while (!onward.empty()) {
    loops.emplace_back();
    for (auto next = onward.begin(); next != onward.end(); next = onward.find(loops.back().back())) {
      if (loops.back().empty()) loops.back().push_back(next->first);
      const int to = next->second;
      onward.erase(next);
      if (to == loops.back().front()) break;
      loops.back().push_back(to);
    }
  }
  return loops;
}

/// Closes every opening by a fan from the middle of its rim. The largest, when it is more than a hole, is the neck
/// where the scan ends: its triangles are marked as a cut.
void CloseOpenings(const std::filesystem::path& file, TriangleMesh& mesh, std::vector<std::string>& messages) {
  constexpr double kHole_mm2 = 1.0;      // smaller openings are holes in the scan
  constexpr double kLargestShare = 0.5;  // of the surface's own area that its openings may have
  const auto loops = Openings(mesh);
  if (loops.empty()) return;
  const size_t scanned = mesh.triangles.size();
  const double scanned_mm2 = AreaOf(mesh, 0);
  size_t neck_begin = 0, neck_end = 0;
  double neck_mm2 = 0;
  for (const auto& loop : loops) {
    const size_t begin = mesh.triangles.size();
    const auto close = [&](int a, int b, int c) {
      const glm::dvec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
      if (glm::length(glm::cross(q - p, r - p)) > 0)
        mesh.triangles.emplace_back(a, b, c);  // else nothing is open there
    };
    if (loop.size() == 3) {
      close(loop[0], loop[1], loop[2]);
    } else {
      glm::dvec3 middle(0.0);
      double length = 0;
      for (size_t i = 0; i < loop.size(); ++i) {
        const glm::dvec3 &a = mesh.vertices[loop[i]], &b = mesh.vertices[loop[(i + 1) % loop.size()]];
        middle += glm::distance(a, b) * 0.5 * (a + b);
        length += glm::distance(a, b);
      }
      const int centre = static_cast<int>(mesh.vertices.size());
      mesh.vertices.push_back(middle / length);
      for (auto& [name, values] : mesh.vertex_properties) {
        double sum = 0;
        for (int v : loop) sum += values[v];
        values.push_back(sum / static_cast<double>(loop.size()));
      }
      for (size_t i = 0; i < loop.size(); ++i) close(loop[i], loop[(i + 1) % loop.size()], centre);
    }
    if (const double area = AreaOf(mesh, begin); area > neck_mm2) {
      neck_begin = begin, neck_end = mesh.triangles.size(), neck_mm2 = area;
    }
  }
  const double closed_mm2 = AreaOf(mesh, scanned);
  if (closed_mm2 > kLargestShare * scanned_mm2)
    throw InputError(file, "",
                     "the surface is not closed: its openings have an area of " + std::to_string(closed_mm2) +
                         " mm2, the surface itself has only " + std::to_string(scanned_mm2),
                     "Scan the whole crown, or close the mesh in the scanner's software.");
  mesh.is_cut.clear();
  const bool has_neck = neck_mm2 > kHole_mm2;
  if (has_neck) {
    mesh.is_cut.assign(mesh.triangles.size(), 0);
    std::fill(mesh.is_cut.begin() + static_cast<long>(neck_begin), mesh.is_cut.begin() + static_cast<long>(neck_end),
              1);
  }
  const size_t holes = loops.size() - (has_neck ? 1 : 0);
  if (has_neck)
    messages.push_back(Printed("%s: the neck is open and was closed (%.1f mm2)", file.filename().c_str(), neck_mm2));
  if (holes > 0)
    messages.push_back(Printed("%s: %zu hole%s closed (%.2f mm2)", file.filename().c_str(), holes, holes > 1 ? "s" : "",
                               closed_mm2 - (has_neck ? neck_mm2 : 0.0)));
}

size_t OpenEdges(const std::unordered_map<uint64_t, DirectedEdges>& edges) {
  return static_cast<size_t>(std::count_if(edges.begin(), edges.end(), [](const auto& e) {
    return (e.second.forward.size() + e.second.backward.size()) % 2 != 0;
  }));
}

/// Takes out the vertices of no triangle; returns how many there were. They would count where vertices stand for the
/// surface.
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

/// Of every vertex the first one at exactly its position.
std::vector<int> FirstThere(const TriangleMesh& mesh) {
  std::vector<int> order(mesh.vertices.size());
  std::iota(order.begin(), order.end(), 0);
  const auto place = [&](int i) {
    const glm::dvec3& v = mesh.vertices[i];
    return std::array{v.x, v.y, v.z};
  };
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto pa = place(a), pb = place(b);
    return pa != pb ? pa < pb : a < b;
  });
  std::vector<int> first(order.size());
  for (size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && place(order[i]) == place(order[i - 1]) ? first[order[i - 1]] : order[i];
  return first;
}

/// Merges vertices at exactly equal positions (STL has none shared; texture seams double them).
void Weld(TriangleMesh& mesh) {
  const std::vector<int> first = FirstThere(mesh);
  for (auto& t : mesh.triangles) t = {first[t.x], first[t.y], first[t.z]};
}

/// Takes out faces between corners that another has already, whichever way round (exports with both sides); returns how
/// many there were. Their surface would be crossed twice.
size_t DropRepeatedFaces(TriangleMesh& mesh) {
  const std::vector<int> first = FirstThere(mesh);
  std::set<std::array<int, 3>> seen;
  return std::erase_if(mesh.triangles, [&](const glm::ivec3& t) {
    std::array<int, 3> corners{first[t.x], first[t.y], first[t.z]};
    std::sort(corners.begin(), corners.end());
    if (corners[0] == corners[1] || corners[1] == corners[2]) return false;  // collapsed
    return !seen.insert(corners).second;
  });
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
  mesh.corner_uv.clear();  // repairs would not keep them
  const std::string name = file.filename().string();
  const auto [low, high] = Bounds(mesh);
  const double size_mm = glm::length(high - low);
  if (size_mm < 1.0 || size_mm > 200.0)
    throw InputError(file, "",
                     "the mesh is " + std::to_string(size_mm) + " mm across, which is not the size of a crown",
                     "Meshes are in millimetres: scale the mesh if it was exported in metres or inches.");
  constexpr double kFarthest_mm = 1e4;  // rays are single precision: a step of 1 micrometre there
  if (glm::length(high) > kFarthest_mm || glm::length(low) > kFarthest_mm)
    throw InputError(file, "", "the crown lies " + std::to_string(glm::length(low)) + " mm from the origin",
                     "Move the mesh near the origin, and the poses with it: ray casting is too coarse so far away.");
  if (const size_t loose = DropLooseVertices(mesh); loose > 0)
    messages.push_back(name + ": " + std::to_string(loose) + " vertices that belong to no triangle were removed");
  if (const size_t repeated = DropRepeatedFaces(mesh); repeated > 0)
    messages.push_back(name + ": " + std::to_string(repeated) + " duplicate faces were removed");
  if (OpenEdges(EdgesOf(mesh)) > 0) Weld(mesh);
  const size_t before = mesh.triangles.size();
  std::erase_if(mesh.triangles, [&](const glm::ivec3& t) {
    return t.x == t.y || t.y == t.z || t.z == t.x;  // what welding or a scanner's decimation collapsed
  });
  if (mesh.triangles.size() < before)
    messages.push_back(name + ": " + std::to_string(before - mesh.triangles.size()) +
                       " collapsed triangles were removed");
  for (const glm::ivec3& t : mesh.triangles) {
    // A sliver without area has no normal; nudging is not needed as its neighbours cover the place.
    const glm::dvec3 n = glm::cross(mesh.vertices[t.y] - mesh.vertices[t.x], mesh.vertices[t.z] - mesh.vertices[t.x]);
    if (!(glm::length(n) > 0.0))
      throw InputError(file, "", "a triangle with three different corners has no area",
                       "Remove degenerate faces in a mesh editor: they have no normal.");
  }
  if (mesh.triangles.empty())
    throw InputError(file, "", "every triangle of the mesh has collapsed to a line or a point");
  DropLooseVertices(mesh);  // those that repairs have left
  if (const size_t turned = AgreeOnOrientation(mesh); turned > 0)
    messages.push_back(name + ": " + std::to_string(turned) + " faces were turned to agree with their neighbours");
  CloseOpenings(file, mesh, messages);
  if (Volume(mesh) < 0) {
    for (auto& t : mesh.triangles) std::swap(t.y, t.z);
    messages.push_back(name + ": the surface was inside out and has been turned");
  }
  return mesh;
}

}  // namespace crownfit
