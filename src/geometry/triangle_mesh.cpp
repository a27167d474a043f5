#include "geometry/triangle_mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <unordered_map>

#include "geometry/edge_key.h"

namespace crownfit {

glm::dvec3 Position(const TriangleMesh& mesh, const SurfacePoint& p) {
  const glm::ivec3 t = mesh.triangles[p.triangle];
  return p.weights.x * mesh.vertices[t.x] + p.weights.y * mesh.vertices[t.y] + p.weights.z * mesh.vertices[t.z];
}

namespace {

glm::dvec3 AreaVector(const TriangleMesh& mesh, const glm::ivec3& t) {
  const glm::dvec3& a = mesh.vertices[t.x];
  return 0.5 * glm::cross(mesh.vertices[t.y] - a, mesh.vertices[t.z] - a);
}

}  // namespace

glm::dvec3 FaceNormal(const TriangleMesh& mesh, int triangle) {
  return glm::normalize(AreaVector(mesh, mesh.triangles[triangle]));
}

double Area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) sum += glm::length(AreaVector(mesh, t));
  return sum;
}

double Volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles)
    sum += glm::dot(mesh.vertices[t.x], glm::cross(mesh.vertices[t.y], mesh.vertices[t.z])) / 6.0;
  return sum;
}

std::pair<glm::dvec3, glm::dvec3> Bounds(const TriangleMesh& mesh) {
  glm::dvec3 low(HUGE_VAL), high(-HUGE_VAL);
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      low = glm::min(low, mesh.vertices[t[k]]);
      high = glm::max(high, mesh.vertices[t[k]]);
    }
  }
  return {low, high};
}

std::vector<std::array<glm::dvec3, 3>> CornerNormals(const TriangleMesh& mesh, double crease_deg) {
  const double crease_cosine = std::cos(crease_deg * std::numbers::pi / 180.0);
  struct Corner {
    int triangle;
    double angle;
  };
  std::vector<std::vector<Corner>> around(mesh.vertices.size());
  std::vector<glm::dvec3> face(mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    face[t] = FaceNormal(mesh, static_cast<int>(t));
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& p = mesh.vertices[mesh.triangles[t][k]];
      const glm::dvec3 u = glm::normalize(mesh.vertices[mesh.triangles[t][(k + 1) % 3]] - p);
      const glm::dvec3 v = glm::normalize(mesh.vertices[mesh.triangles[t][(k + 2) % 3]] - p);
      around[mesh.triangles[t][k]].push_back({static_cast<int>(t), std::acos(std::clamp(glm::dot(u, v), -1.0, 1.0))});
    }
  }
  std::vector<std::array<glm::dvec3, 3>> normals(mesh.triangles.size());
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      glm::dvec3 sum(0.0);
      for (const Corner& corner : around[mesh.triangles[t][k]])
        if (glm::dot(face[corner.triangle], face[t]) >= crease_cosine) sum += corner.angle * face[corner.triangle];
      normals[t][k] = glm::normalize(sum);
    }
  }
  return normals;
}

TriangleMesh Refined(const TriangleMesh& mesh, double edge_mm) {
  // Whether an edge is split depends on its length alone, so the two faces beside it agree and no gap opens.
  TriangleMesh fine = mesh;
  for (bool again = true; again;) {
    again = false;
    std::unordered_map<uint64_t, int> middle;
    const auto split = [&](int a, int b) {
      if (glm::distance(fine.vertices[a], fine.vertices[b]) <= edge_mm) return -1;
      const auto [slot, is_new] = middle.try_emplace(EdgeKey(a, b), static_cast<int>(fine.vertices.size()));
      if (is_new) {
        fine.vertices.push_back(0.5 * (fine.vertices[a] + fine.vertices[b]));
        for (auto& [name, values] : fine.vertex_properties) values.push_back(0.5 * (values[a] + values[b]));
      }
      return slot->second;
    };
    std::vector<glm::ivec3> triangles;
    triangles.reserve(fine.triangles.size());
    std::vector<uint8_t> is_cut;
    for (size_t i = 0; i < fine.triangles.size(); ++i) {
      const glm::ivec3& t = fine.triangles[i];
      const int m[3] = {split(t[0], t[1]), split(t[1], t[2]), split(t[2], t[0])};
      const int count = (m[0] >= 0) + (m[1] >= 0) + (m[2] >= 0);
      again |= count > 0;
      if (count == 0) {
        triangles.push_back(t);
      } else if (count == 3) {
        triangles.insert(triangles.end(),
                         {{t[0], m[0], m[2]}, {m[0], t[1], m[1]}, {m[2], m[1], t[2]}, {m[0], m[1], m[2]}});
      } else {
        // Rotates the corners so that edge 0 is split and, with two splits, edges 0 and 1 are.
        int k = 0;
        while (!(m[k] >= 0 && (count == 1 || m[(k + 1) % 3] >= 0))) ++k;
        const int a = t[k], b = t[(k + 1) % 3], c = t[(k + 2) % 3], ab = m[k], bc = m[(k + 1) % 3];
        if (count == 1) {
          triangles.insert(triangles.end(), {{a, ab, c}, {ab, b, c}});
        } else {
          triangles.insert(triangles.end(), {{ab, b, bc}, {a, ab, bc}, {a, bc, c}});
        }
      }
      if (!fine.is_cut.empty()) is_cut.resize(triangles.size(), fine.is_cut[i]);
    }
    fine.triangles = std::move(triangles);
    fine.is_cut = std::move(is_cut);
  }
  return fine;
}

std::pair<glm::dvec3, glm::dvec3> Tangents(const glm::dvec3& n) {
  const double sign = std::copysign(1.0, n.z), a = -1.0 / (sign + n.z), b = n.x * n.y * a;
  return {{1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}};
}

namespace {

TriangleMesh Part(const TriangleMesh& mesh, bool cut) {
  TriangleMesh part;
  part.vertices = mesh.vertices;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.cut(static_cast<int>(t)) == cut) part.triangles.push_back(mesh.triangles[t]);
  return part;
}

}  // namespace

TriangleMesh CutPart(const TriangleMesh& mesh) { return Part(mesh, true); }
TriangleMesh ScannedPart(const TriangleMesh& mesh) { return Part(mesh, false); }

TriangleMesh SquareTile(const glm::dvec3& centre, const glm::dvec3& normal, double size_mm) {
  const auto [u, v] = Tangents(normal);
  const double h = 0.5 * size_mm;
  TriangleMesh tile;
  tile.vertices = {centre - h * u - h * v, centre + h * u - h * v, centre + h * u + h * v, centre - h * u + h * v};
  tile.triangles = {{0, 1, 2}, {0, 2, 3}};
  return tile;
}

}  // namespace crownfit
