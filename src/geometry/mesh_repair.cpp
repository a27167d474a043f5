// Repairs a mesh to a closed, outward-oriented surface, or reports why that is impossible.

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/text.h"
#include "geometry/mesh_bytes.h"
#include "geometry/mesh_edges.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

double AreaOf(const TriangleMesh& mesh, size_t first_triangle) {
  double sum = 0;
  for (size_t t = first_triangle; t < mesh.triangles.size(); ++t) sum += AreaOf(mesh, mesh.triangles[t]);
  return sum;
}

/// Boundary loops of the surface, each oriented as the triangles that close it need.
std::vector<std::vector<int>> Openings(const TriangleMesh& mesh) {
  const std::vector<int> ranks = RanksByPosition(mesh);
  std::vector<int> vertex(ranks.size());
  for (size_t v = 0; v < ranks.size(); ++v) vertex[ranks[v]] = static_cast<int>(v);
  std::multiset<std::pair<int, int>> onward;  // ranks
  for (const auto& [key, edge] : EdgesOf(mesh)) {
    const int low = ranks[key >> 32], high = ranks[key & 0xffffffffu];
    for (size_t k = edge.backward.size(); k < edge.forward.size(); ++k) onward.emplace(high, low);
    for (size_t k = edge.forward.size(); k < edge.backward.size(); ++k) onward.emplace(low, high);
  }
  std::vector<std::vector<int>> loops;
  while (!onward.empty()) {
    // Where a way meets itself, a loop is complete: openings that touch in a vertex are two.
    std::vector<int> way{onward.begin()->first};
    for (auto next = onward.lower_bound({way.back(), 0}); next != onward.end() && next->first == way.back();
         next = onward.lower_bound({way.back(), 0})) {
      const int to = next->second;
      onward.erase(next);
      const auto met = std::find(way.begin(), way.end(), to);
      if (met == way.end()) {
        way.push_back(to);
        continue;
      }
      loops.emplace_back();
      for (auto at = met; at != way.end(); ++at) loops.back().push_back(vertex[*at]);
      way.erase(met + 1, way.end());
      if (way.size() == 1) break;
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
        mesh.triangles.emplace_back(a, b, c);  // otherwise nothing is open there
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

}  // namespace

TriangleMesh ReadClosedSurface(const std::filesystem::path& file, std::vector<std::string>& messages) {
  TriangleMesh mesh = ReadMeshFile(file);
  mesh.corner_uv.clear();  // repairs would invalidate them
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
  DropRepeatedFaces(mesh, name, messages);
  const double rounding_mm = 1e-5 * size_mm;  // 0.1 micrometre of a crown
  if (const size_t collapsed = WeldSeams(mesh, rounding_mm, name, messages); collapsed > 0)
    messages.push_back(name + ": " + std::to_string(collapsed) + " collapsed triangles were removed");
  SplitAtCorners(mesh, rounding_mm, name, messages);
  for (const glm::ivec3& t : mesh.triangles) {
    // A sliver without area has no normal; nudging is not needed as its neighbours cover the place.
    if (!(AreaOf(mesh, t) > 0.0))
      throw InputError(file, "",
                       "a triangle with three different corners has no area, at " + PlaceInWords(mesh.vertices[t.x]),
                       "Remove degenerate faces in a mesh editor: they have no normal.");
  }
  if (mesh.triangles.empty())
    throw InputError(file, "", "every triangle of the mesh has collapsed to a line or a point");
  DropLooseVertices(mesh);  // those that repairs have left
  const std::vector<glm::ivec3> before = mesh.triangles;
  AgreeOnOrientation(file, mesh);
  CloseOpenings(file, mesh, messages);
  TurnShells(mesh);
  SayWhatTurned(mesh, before, name, messages);
  return mesh;
}

}  // namespace crownfit
