#include "geometry/mesh_bytes.h"

#include <charconv>

#include "base/error.h"

namespace crownfit {

void BadMesh(const std::filesystem::path& file, const std::string& message, const std::string& remedy) {
  throw InputError(file, "", message, remedy.empty() ? "Export the mesh again as binary PLY or STL." : remedy);
}

double NumberFrom(const std::filesystem::path& file, const std::string& word) {
  double v = 0;
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), v);
  if (error != std::errc() || end != word.data() + word.size())
    BadMesh(file, "'" + word.substr(0, 20) + "' is not a number");
  return v;
}

void AddPolygon(const std::filesystem::path& file, TriangleMesh& mesh, const std::vector<long>& corners,
                double most_triangles) {
  if (corners.size() < 3) BadMesh(file, "a face has fewer than 3 corners");
  if (static_cast<double>(mesh.triangles.size() + corners.size() - 2) > most_triangles)
    BadMesh(file, "the mesh has more than " + std::to_string(static_cast<long>(most_triangles)) + " triangles",
            kManyTriangles);
  for (long c : corners)
    if (c < 0 || c >= static_cast<long>(mesh.vertices.size()))
      BadMesh(file,
              "a face names vertex " + std::to_string(c) + ", but there are " + std::to_string(mesh.vertices.size()));
  for (size_t k = 2; k < corners.size(); ++k) mesh.triangles.emplace_back(corners[0], corners[k - 1], corners[k]);
}

void AddPolygonUv(TriangleMesh& mesh, const std::vector<glm::dvec2>& corners) {
  for (size_t k = 2; k < corners.size(); ++k) mesh.corner_uv.push_back({corners[0], corners[k - 1], corners[k]});
}

}  // namespace crownfit
