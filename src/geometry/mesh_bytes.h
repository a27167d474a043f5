#pragma once
// Shared by the readers of mesh files: bytes, limits, error messages.

#include <algorithm>
#include <bit>
#include <cstring>
#include <filesystem>
#include <string>
#include <vector>

#include "base/limits.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Throws InputError; the default remedy is to export the mesh again.
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
  /// Next line; it ends with LF, CR LF or CR.
  std::string Line() {
    if (at >= data.size()) BadMesh(file, "the file is truncated");
    const size_t end = std::min(data.find_first_of("\r\n", at), data.size());
    std::string line = data.substr(at, end - at);
    at = end + (data.compare(end, 2, "\r\n") == 0 ? 2 : 1);
    return line;
  }
  /// Of what was read last, from 1 on.
  size_t LineNumber() const {
    size_t number = 1;
    for (size_t i = 0; i + 1 < at && i < data.size(); ++i)
      number += data[i] == '\n' || (data[i] == '\r' && data.compare(i, 2, "\r\n") != 0);
    return number;
  }
  void SkipByteOrderMark() {
    if (data.starts_with("\xef\xbb\xbf")) at = 3;
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

/// Limits on the number of triangles, and on the file size for so many. The longest format, ASCII STL, takes 250 bytes
/// per triangle.
struct MeshLimits {
  double triangles = 1e6 * InputLimits().mesh_million_triangles;
  double bytes = 256 * triangles;
};
inline constexpr const char* kManyTriangles =
    "Reduce the mesh in the scanner's software, or raise CROWNFIT_MAX_MESH_MILLION_TRIANGLES.";

/// "(1.2, -0.5, 3) mm"
std::string PlaceInWords(const glm::dvec3& p);

/// The number that is written in the whole word, the last that was read. Throws InputError, which names the line.
double NumberFrom(const MeshBytes& in, const std::string& word);

/// Throws InputError where a vertex is not finite or far from where meshes are.
void CheckPlaces(const std::filesystem::path& file, const std::vector<glm::dvec3>& vertices);

/// Faces as a file names them, until all its vertices are known.
struct PolygonList {
  std::vector<long> corners;   ///< of all faces in a row
  std::vector<size_t> counts;  ///< corners of each face
  std::vector<glm::dvec2> uv;  ///< one a corner; the mesh gets none where some are missing
  bool has_all_uv = true;
  void Add(const std::vector<long>& face, const std::vector<glm::dvec2>& face_uv);
};

/// Adds the triangles of all faces to a mesh that has its vertices: a collapsed one where all corners of a polygon lie
/// on one line. Throws InputError: too few corners, a vertex that
/// does not exist, a polygon that crosses itself, too many corners or triangles.
void AddPolygons(const std::filesystem::path& file, const PolygonList& polygons, double most_triangles,
                 TriangleMesh& mesh);

/// The mesh of a PLY file, text or binary, with its vertices' properties.
TriangleMesh ReadPly(MeshBytes& in, const MeshLimits& limits);

}  // namespace crownfit
