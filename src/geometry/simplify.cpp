#include <meshoptimizer.h>

#include "geometry/triangle_mesh.h"

namespace crownfit {
namespace {

/// The triangles of one kind (cut or not) that simplification leaves of a mesh with so many of both.
std::vector<glm::ivec3> Left(const TriangleMesh& mesh, const std::vector<glm::vec3>& positions, bool is_cut,
                             double share) {
  std::vector<unsigned> corners;
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.cut(static_cast<int>(t)) == is_cut)
      for (int k = 0; k < 3; ++k) corners.push_back(static_cast<unsigned>(mesh.triangles[t][k]));
  if (corners.empty()) return {};
  const size_t all = corners.size() / 3, wanted = 3 * static_cast<size_t>(share * static_cast<double>(all));
  constexpr float kAnyError = 1.0f;  // of the mesh's size
  std::vector<unsigned> left(corners.size());
  left.resize(meshopt_simplify(left.data(), corners.data(), corners.size(), &positions[0].x, positions.size(),
                               sizeof(glm::vec3), wanted, kAnyError, meshopt_SimplifyLockBorder, nullptr));
  std::vector<glm::ivec3> triangles;
  for (size_t i = 0; i < left.size(); i += 3) triangles.emplace_back(left[i], left[i + 1], left[i + 2]);
  return triangles;
}

}  // namespace

TriangleMesh Simplified(const TriangleMesh& mesh, size_t triangles) {
  if (mesh.triangles.size() <= triangles) return mesh;
  const std::vector<glm::vec3> positions(mesh.vertices.begin(), mesh.vertices.end());
  const double share = static_cast<double>(triangles) / static_cast<double>(mesh.triangles.size());
  TriangleMesh simple;
  std::vector<int> target(mesh.vertices.size(), -1);
  for (const bool is_cut : {false, true})
    for (glm::ivec3 t : Left(mesh, positions, is_cut, share)) {
      for (int k = 0; k < 3; ++k) {
        int& to = target[t[k]];
        if (to < 0) {
          to = static_cast<int>(simple.vertices.size());
          simple.vertices.push_back(mesh.vertices[t[k]]);
        }
        t[k] = to;
      }
      simple.triangles.push_back(t);
      if (!mesh.is_cut.empty()) simple.is_cut.push_back(is_cut);
    }
  return simple;
}

}  // namespace crownfit
