#include "geometry/mesh_bytes.h"

#include <charconv>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "geometry/polygon.h"

namespace crownfit {
namespace {

/// Whether all corners lie on one line, up to rounding.
bool IsStraight(const std::vector<glm::dvec3>& corners) {
  constexpr double kRounding = 1e-6;  // of the length
  const auto from_first = [&](const glm::dvec3& p) { return glm::distance(p, corners[0]); };
  const glm::dvec3 far =
      *std::max_element(corners.begin(), corners.end(),
                        [&](const glm::dvec3& p, const glm::dvec3& q) { return from_first(p) < from_first(q); });
  const glm::dvec3 line = far - corners[0];
  return std::all_of(corners.begin(), corners.end(), [&](const glm::dvec3& p) {
    return glm::length(glm::cross(p - corners[0], line)) <= kRounding * glm::dot(line, line);
  });
}

}  // namespace

void BadMesh(const std::filesystem::path& file, const std::string& message, const std::string& remedy) {
  throw InputError(file, "", message, remedy.empty() ? "Export the mesh again as binary PLY or STL." : remedy);
}

std::string PlaceInWords(const glm::dvec3& p) { return Printed("(%.4g, %.4g, %.4g) mm", p.x, p.y, p.z); }

double NumberFrom(const MeshBytes& in, const std::string& word) {
  double v = 0;
  const char* begin = word.data() + (word.starts_with("+") && !word.starts_with("+-") ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), v);
  if (error != std::errc() || end != word.data() + word.size())
    BadMesh(in.file,
            "line " + std::to_string(in.LineNumber()) + ": " +
                (word.empty() ? "a number is missing" : "'" + word.substr(0, 20) + "' is not a number"),
            word.find(',') != word.npos ? "Export the mesh with a point as decimal sign, not with a comma." : "");
  return v;
}

void CheckPlaces(const std::filesystem::path& file, const std::vector<glm::dvec3>& vertices) {
  constexpr double kFarthest_mm = 1e5;  // rays are single precision: a step of 0.008 mm there
  for (size_t i = 0; i < vertices.size(); ++i) {
    const glm::dvec3& v = vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      BadMesh(file, "vertex " + std::to_string(i) + " is not finite (NaN or infinity)");
    if (glm::length(v) > kFarthest_mm)
      BadMesh(file, "vertex " + std::to_string(i) + " lies more than 100 m from the origin", "Meshes are in mm.");
  }
}

void PolygonList::Add(const std::vector<long>& face, const std::vector<glm::dvec2>& face_uv) {
  corners.insert(corners.end(), face.begin(), face.end());
  counts.push_back(face.size());
  has_all_uv = has_all_uv && face_uv.size() == face.size();
  if (has_all_uv) uv.insert(uv.end(), face_uv.begin(), face_uv.end());
}

void AddPolygons(const std::filesystem::path& file, const PolygonList& polygons, double most_triangles,
                 TriangleMesh& mesh) {
  constexpr size_t kMostCorners = 1000;  // ear clipping takes time by their square and more
  CheckPlaces(file, mesh.vertices);
  size_t begin = 0;
  for (size_t face = 0; face < polygons.counts.size(); begin += polygons.counts[face++]) {
    const size_t count = polygons.counts[face];
    const std::string name = "face " + std::to_string(face + 1);
    if (count < 3) BadMesh(file, name + " has fewer than 3 corners");
    if (count > kMostCorners)
      BadMesh(file, name + " has " + std::to_string(count) + " corners", "Triangulate the mesh before export.");
    if (static_cast<double>(mesh.triangles.size() + count - 2) > most_triangles)
      BadMesh(file, "the mesh has more than " + std::to_string(static_cast<long>(most_triangles)) + " triangles",
              kManyTriangles);
    std::vector<glm::dvec3> places;
    for (size_t k = 0; k < count; ++k) {
      const long c = polygons.corners[begin + k];
      if (c < 0 || c >= static_cast<long>(mesh.vertices.size()))
        BadMesh(file, name + " names vertex " + std::to_string(c) + ", but there are " +
                          std::to_string(mesh.vertices.size()));
      places.push_back(mesh.vertices[c]);
    }
    const auto triangles =
        count > 3 && IsStraight(places) ? std::optional(std::vector{std::array{0, 0, 0}}) : Triangulated(places);
    if (!triangles)
      BadMesh(file,
              name + " is a polygon that crosses itself or has no area; its first corner is " + PlaceInWords(places[0]),
              "Triangulate the mesh before export, or mend the face in a mesh editor.");
    for (const std::array<int, 3>& t : *triangles) {
      const auto corner = [&](int k) { return static_cast<int>(polygons.corners[begin + t[k]]); };
      mesh.triangles.emplace_back(corner(0), corner(1), corner(2));
      if (polygons.has_all_uv)
        mesh.corner_uv.push_back({polygons.uv[begin + t[0]], polygons.uv[begin + t[1]], polygons.uv[begin + t[2]]});
    }
  }
}

}  // namespace crownfit
