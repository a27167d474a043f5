#pragma once
// What the readers of mesh files share: their bytes, their limits, their complaints.

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "base/limits.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Throws InputError; without a remedy: to export the mesh again.
[[noreturn]] void BadMesh(const std::filesystem::path& file, const std::string& message,
                          const std::string& remedy = "");

/// Bytes of the file with bounds-checked reading.
struct MeshBytes {
  const std::filesystem::path& file;
  std::string data;
  size_t at = 0;

  template <class T>
  T Take(bool big_endian = false) {
    if (at + sizeof(T) > data.size()) BadMesh(file, "the file is truncated");
    char raw[sizeof(T)];
    std::memcpy(raw, data.data() + at, sizeof(T));
    at += sizeof(T);
    if (big_endian) std::reverse(raw, raw + sizeof(T));
    return std::bit_cast<T>(raw);
  }
  std::string Line() {
    if (at >= data.size()) BadMesh(file, "the file is truncated");
    const size_t end = std::min(data.find('\n', at), data.size());
    std::string line = data.substr(at, end - at);
    at = end + 1;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }
  /// Next word, across lines.
  std::string Word() {
    while (at < data.size() && std::isspace(static_cast<unsigned char>(data[at]))) ++at;
    const size_t begin = at;
    while (at < data.size() && !std::isspace(static_cast<unsigned char>(data[at]))) ++at;
    if (begin == at) BadMesh(file, "the file is truncated");
    return data.substr(begin, at - begin);
  }
};

/// The most triangles and what a file of so many may weigh; the longest way to write one takes ASCII STL 250 bytes.
struct MeshLimits {
  double triangles = 1e6 * InputLimits().mesh_million_triangles;
  double bytes = 256 * triangles;
};
inline constexpr const char* kManyTriangles =
    "Reduce the mesh in the scanner's software, or raise CROWNFIT_MAX_MESH_MILLION_TRIANGLES.";

/// The number that is written in the whole word. Throws InputError.
double NumberFrom(const std::filesystem::path& file, const std::string& word);

/// Adds the fan of a face's corners. Throws InputError: too few corners, a vertex that does not exist, too many
/// triangles.
void AddPolygon(const std::filesystem::path& file, TriangleMesh& mesh, const std::vector<long>& corners,
                double most_triangles);

/// The same fan of texture coordinates, one per corner; without them the mesh as a whole gets none.
void AddPolygonUv(TriangleMesh& mesh, const std::vector<glm::dvec2>& corners);

/// The mesh of a PLY file, text or binary, with its vertices' properties.
TriangleMesh ReadPly(MeshBytes& in, const MeshLimits& limits);

}  // namespace crownfit
