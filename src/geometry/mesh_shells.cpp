// Which way the faces of a closed surface look, body by body.

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "base/error.h"
#include "base/text.h"
#include "geometry/mesh_bytes.h"
#include "geometry/mesh_edges.h"
#include "geometry/ray_caster.h"
#include "geometry/signed_distance.h"

namespace crownfit {
namespace {

/// The bodies that a closed surface consists of: faces joined across plain edges; all that these do not close count as
/// one.
std::vector<std::vector<int>> ShellsOf(const TriangleMesh& mesh) {
  const auto edges = EdgesOf(mesh);
  std::vector<std::vector<int>> shells;
  std::vector<int> rest, shell_of(mesh.triangles.size(), -1);
  for (size_t first = 0; first < mesh.triangles.size(); ++first) {
    if (shell_of[first] >= 0) continue;
    std::vector<int> shell{static_cast<int>(first)};
    const int number = static_cast<int>(first);
    shell_of[first] = number;
    std::map<uint64_t, int> balance;
    for (size_t next = 0; next < shell.size(); ++next)
      for (int k = 0; k < 3; ++k) {
        const int a = mesh.triangles[shell[next]][k], b = mesh.triangles[shell[next]][(k + 1) % 3];
        const DirectedEdges& edge = edges.at(EdgeKey(a, b));
        if (edge.forward.size() + edge.backward.size() != 2) {
          balance[EdgeKey(a, b)] += a < b ? 1 : -1;
          continue;
        }
        for (const auto* side : {&edge.forward, &edge.backward})
          for (const int other : *side)
            if (shell_of[other] < 0) shell_of[other] = number, shell.push_back(other);
      }
    const bool is_closed = std::all_of(balance.begin(), balance.end(), [](const auto& e) { return e.second == 0; });
    if (is_closed)
      shells.push_back(std::move(shell));
    else
      rest.insert(rest.end(), shell.begin(), shell.end());
  }
  if (!rest.empty()) shells.push_back(std::move(rest));
  return shells;
}

/// Some of a mesh's triangles with their own vertices, in the same order. `places` holds -1 for every vertex of the
/// mesh, before and after.
TriangleMesh PartOf(const TriangleMesh& mesh, const std::vector<int>& triangles, std::vector<int>& places) {
  TriangleMesh part;
  for (const int t : triangles) {
    glm::ivec3 corners = mesh.triangles[t];
    for (int k = 0; k < 3; ++k) {
      int& place = places[corners[k]];
      if (place < 0) {
        place = static_cast<int>(part.vertices.size());
        part.vertices.push_back(mesh.vertices[corners[k]]);
      }
      corners[k] = place;
    }
    part.triangles.push_back(corners);
  }
  for (const int t : triangles)
    for (int k = 0; k < 3; ++k) places[mesh.triangles[t][k]] = -1;
  return part;
}

struct Shell {
  const std::vector<int>& triangles;
  TriangleMesh mesh;  ///< looks outwards
  bool was_inside_out;
  std::pair<glm::dvec3, glm::dvec3> bounds;
  std::unique_ptr<RayCaster> caster;  ///< once it is needed
};

/// Whether the middles of most of a shell's faces lie inside another shell.
bool Holds(Shell& outer, const Shell& inner) {
  constexpr size_t kSamples = 9;
  if (glm::any(glm::lessThan(inner.bounds.first, outer.bounds.first)) ||
      glm::any(glm::greaterThan(inner.bounds.second, outer.bounds.second)))
    return false;
  if (!outer.caster) outer.caster = std::make_unique<RayCaster>(std::vector<const TriangleMesh*>{&outer.mesh});
  const auto& triangles = inner.mesh.triangles;
  size_t inside = 0;
  for (size_t i = 0; i < kSamples; ++i) {
    const SurfacePoint middle{static_cast<int>(i * triangles.size() / kSamples), glm::dvec3(1.0 / 3.0)};
    inside += IsInside(*outer.caster, outer.mesh, Position(inner.mesh, middle));
  }
  return 2 * inside > kSamples;
}

}  // namespace

void AgreeOnOrientation(const std::filesystem::path& file, TriangleMesh& mesh) {
  const auto edges = EdgesOf(mesh);
  const auto runs_forward = [&](int t, int a, int b) {
    const glm::ivec3& f = mesh.triangles[t];
    for (int k = 0; k < 3; ++k)
      if (f[k] == a && f[(k + 1) % 3] == b) return true;
    return false;
  };
  std::vector<char> seen(mesh.triangles.size(), 0);
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
            if (other == t) continue;
            if (!seen[other]) {
              seen[other] = 1;
              if (runs_forward(other, a, b)) std::swap(mesh.triangles[other].y, mesh.triangles[other].z);
              component.push_back(other);
            } else if (runs_forward(other, a, b)) {
              throw InputError(file, "",
                               "the surface has only one side: its faces can't all look outwards. One that can't lies "
                               "at " +
                                   PlaceInWords(mesh.vertices[a]),
                               "Mend the surface there in a mesh editor.");
            }
          }
        }
      }
    }
    glm::dvec3 middle(0.0);
    double area_mm2 = 0, volume_mm3 = 0;
    for (const int t : component) {
      const double area = AreaOf(mesh, mesh.triangles[t]);
      middle += area * Position(mesh, {t, glm::dvec3(1.0 / 3.0)});
      area_mm2 += area;
    }
    middle /= area_mm2;
    for (const int t : component) {
      const glm::ivec3& f = mesh.triangles[t];
      volume_mm3 +=
          glm::dot(mesh.vertices[f.x] - middle, glm::cross(mesh.vertices[f.y] - middle, mesh.vertices[f.z] - middle));
    }
    if (volume_mm3 < 0)
      for (const int t : component) std::swap(mesh.triangles[t].y, mesh.triangles[t].z);
  }
}

void TurnShells(TriangleMesh& mesh) {
  const std::vector<std::vector<int>> parts = ShellsOf(mesh);
  std::vector<int> places(mesh.vertices.size(), -1);
  std::vector<Shell> shells;
  for (const auto& triangles : parts) {
    Shell shell{triangles, PartOf(mesh, triangles, places), false, {}, nullptr};
    shell.was_inside_out = Volume(shell.mesh) < 0;
    if (shell.was_inside_out)
      for (auto& t : shell.mesh.triangles) std::swap(t.y, t.z);
    shell.bounds = Bounds(shell.mesh);
    shells.push_back(std::move(shell));
  }
  for (Shell& shell : shells) {
    size_t around = 0;
    for (Shell& other : shells) around += &other != &shell && Holds(other, shell);
    if (shell.was_inside_out == (around % 2 == 1)) continue;
    for (const int t : shell.triangles) std::swap(mesh.triangles[t].y, mesh.triangles[t].z);
  }
}

void SayWhatTurned(const TriangleMesh& mesh, const std::vector<glm::ivec3>& before, const std::string& name,
                   std::vector<std::string>& messages) {
  const auto is_turned = [&](int t) {
    return static_cast<size_t>(t) < before.size() && mesh.triangles[t].y != before[t].y;
  };
  std::vector<int> places(mesh.vertices.size(), -1);
  size_t faces = 0, bodies = 0;
  double area_mm2 = 0, volume_mm3 = 0;
  const auto shells = ShellsOf(mesh);
  for (const auto& shell : shells) {
    const size_t turned = static_cast<size_t>(std::count_if(shell.begin(), shell.end(), is_turned));
    const size_t of_file = static_cast<size_t>(
        std::count_if(shell.begin(), shell.end(), [&](int t) { return static_cast<size_t>(t) < before.size(); }));
    if (turned == 0) continue;
    if (turned == of_file) {
      ++bodies;
      volume_mm3 += std::abs(Volume(PartOf(mesh, shell, places)));
      continue;
    }
    faces += turned;
    for (const int t : shell)
      if (is_turned(t)) area_mm2 += AreaOf(mesh, mesh.triangles[t]);
  }
  if (faces > 0)
    messages.push_back(
        Printed("%s: %zu faces were turned to agree with their neighbours (%.3g mm2)", name.c_str(), faces, area_mm2));
  if (bodies > 0 && shells.size() == 1)
    messages.push_back(
        Printed("%s: the surface was inside out and has been turned (%.4g mm3)", name.c_str(), volume_mm3));
  else if (bodies > 0)
    messages.push_back(Printed("%s: %zu of %zu closed surfaces were inside out and have been turned (%.4g mm3)",
                               name.c_str(), bodies, shells.size(), volume_mm3));
}

}  // namespace crownfit
