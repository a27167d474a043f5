#pragma once
// Triangle meshes in millimetres.

#include <array>
#include <cstdint>
#include <glm/glm.hpp>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace crownfit {

struct TriangleMesh {
  std::vector<glm::dvec3> vertices;
  std::vector<glm::ivec3> triangles;                             ///< counter-clockwise seen from outside
  std::map<std::string, std::vector<double>> vertex_properties;  ///< further numbers per vertex, by name
  std::set<std::string> byte_properties;                         ///< those that the file holds as 8-bit unsigned
  std::vector<std::array<glm::dvec2, 3>> corner_uv;              ///< per triangle, of the unmodified file; empty: none
  std::vector<uint8_t> is_cut;  ///< per triangle: closes the neck of an open scan; empty: no cut
  bool cut(int triangle) const { return !is_cut.empty() && is_cut[triangle] != 0; }
};

/// A place on a mesh: triangle and barycentric weights of its three vertices.
struct SurfacePoint {
  int triangle = -1;
  glm::dvec3 weights{0.0};
};

glm::dvec3 Position(const TriangleMesh& mesh, const SurfacePoint& p);
glm::dvec3 FaceNormal(const TriangleMesh& mesh, int triangle);       ///< unit, outward
double Area(const TriangleMesh& mesh);                               ///< mm^2
double Volume(const TriangleMesh& mesh);                             ///< mm^3, negative when inside out
std::pair<glm::dvec3, glm::dvec3> Bounds(const TriangleMesh& mesh);  ///< lowest and highest corner

/// One normal per triangle corner: angle-weighted mean over the faces around the vertex that lie within
/// `crease_deg` of this face (Thuermer and Wuthrich 1998), so a smooth scan is smooth and a rim stays sharp.
std::vector<std::array<glm::dvec3, 3>> CornerNormals(const TriangleMesh& mesh, double crease_deg = 40.0);

/// Splits edges at their middle until none is longer than `edge_mm`; the surface stays the same and closed.
/// Vertex properties are interpolated.
TriangleMesh Refined(const TriangleMesh& mesh, double edge_mm);

/// Collapses edges until about so many triangles are left (Garland and Heckbert 1997, by meshoptimizer). Vertices that
/// are left stay where they are, and the edge of a neck's cut stays whole. Vertex properties and uv are dropped, unless
/// the mesh has no more triangles anyway.
TriangleMesh Simplified(const TriangleMesh& mesh, size_t triangles);

/// The triangles that close the neck of an open scan, or all others. Vertices stay.
TriangleMesh CutPart(const TriangleMesh& mesh);
TriangleMesh ScannedPart(const TriangleMesh& mesh);

/// Two triangles, facing `normal`, `size_mm` wide.
TriangleMesh SquareTile(const glm::dvec3& centre_mm, const glm::dvec3& normal, double size_mm);

/// Two unit vectors that complete `normal` to an orthonormal frame (Duff et al. 2017).
std::pair<glm::dvec3, glm::dvec3> Tangents(const glm::dvec3& normal);

}  // namespace crownfit
