#include "geometry/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "base/files.h"
#include "geometry/mesh_bytes.h"

namespace crownfit {
namespace {

long IntegerFrom(const MeshBytes& in, const std::string& word) {
  long v = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), v);
  if (error != std::errc() || end != word.data() + word.size())
    BadMesh(in.file,
            "line " + std::to_string(in.LineNumber()) + ": '" + word.substr(0, 20) + "' is not a vertex number");
  return v;
}

std::string InLowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Words of text, lower-case, and numbers as they are; binary data has a byte of 0 among its first: the header's end,
/// or the last of the triangles' count.
bool IsTextStl(const std::string& data) {
  constexpr size_t kHead = 84;
  const std::string head = InLowerCase(data.substr(0, kHead));
  const size_t first = head.starts_with("\xef\xbb\xbf") ? 3 : head.find_first_not_of(" \t\r\n");
  return first != head.npos && head.compare(first, 5, "solid") == 0 && head.find('\0') == head.npos;
}

TriangleMesh ReadTextStl(MeshBytes& in) {
  TriangleMesh mesh;
  in.SkipByteOrderMark();
  bool is_open = false;
  size_t facet = 0;
  while (in.at < in.data.size()) {
    std::istringstream words(in.Line());
    std::string word, x, y, z;
    words >> word;
    word = InLowerCase(word);
    if (word == "vertex") {
      words >> x >> y >> z;
      mesh.vertices.emplace_back(NumberFrom(in, x), NumberFrom(in, y), NumberFrom(in, z));
    } else if (word == "solid" || word == "endsolid") {
      if ((word == "solid") == is_open) BadMesh(in.file, "a solid begins before the one before it ends");
      is_open = !is_open;
    } else if (word == "facet") {
      facet = mesh.vertices.size();
    } else if (word == "endfacet") {
      if (mesh.vertices.size() != facet + 3)
        BadMesh(in.file, "facet " + std::to_string(facet / 3 + 1) + " does not have three corners");
    }
  }
  if (is_open || mesh.vertices.size() % 3) BadMesh(in.file, "the file is truncated");
  return mesh;
}

TriangleMesh ReadBinaryStl(MeshBytes& in) {
  constexpr size_t kHeader = 84, kFacet = 50;
  uint32_t count = 0;
  if (in.data.size() >= kHeader) std::memcpy(&count, in.data.data() + kHeader - 4, 4);
  const size_t end = kHeader + kFacet * count;
  if (in.data.size() < end || in.data.size() < kHeader)
    BadMesh(
        in.file,
        "neither an ASCII STL nor a binary STL of the length that its triangle count requires; it may be truncated");
  const bool is_padded = in.data.find_first_not_of(std::string(" \r\n\0", 4), end) == std::string::npos;
  if (!is_padded && in.data.size() >= end + kFacet)
    BadMesh(in.file, "the header counts " + std::to_string(count) + " triangles, but " +
                         std::to_string(in.data.size() - end) + " bytes follow them");
  TriangleMesh mesh;
  in.at = kHeader;
  for (uint32_t i = 0; i < count; ++i) {
    in.at += 12;
    for (int k = 0; k < 3; ++k) {
      const float x = in.Take<float>(), y = in.Take<float>(), z = in.Take<float>();
      mesh.vertices.emplace_back(x, y, z);
    }
    in.at += 2;
  }
  return mesh;
}

TriangleMesh ReadStl(MeshBytes& in) {
  TriangleMesh mesh = IsTextStl(in.data) ? ReadTextStl(in) : ReadBinaryStl(in);
  for (size_t i = 0; i + 2 < mesh.vertices.size(); i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

/// The next statement: without a comment, and with what a backslash continues.
std::string ObjStatement(MeshBytes& in) {
  std::string statement;
  for (bool goes_on = true; goes_on && in.at < in.data.size();) {
    statement += in.Line();
    statement.erase(std::min(statement.find('#'), statement.size()));
    const size_t last = statement.find_last_not_of(" \t");
    goes_on = last != statement.npos && statement[last] == '\\';
    if (goes_on) statement.replace(last, statement.npos, " ");
  }
  return statement;
}

/// Throws InputError where every other byte is 0, as in UTF-16.
void CheckBytesAreText(const MeshBytes& in) {
  if (in.data.starts_with("\xff\xfe") || in.data.starts_with("\xfe\xff") ||
      in.data.substr(0, 2).find('\0') != std::string::npos)
    BadMesh(in.file, "the text is UTF-16", "Save it as UTF-8 or as plain text.");
}

TriangleMesh ReadObj(MeshBytes& in, const MeshLimits& limits) {
  // The text format has no count, so only a cut inside the last line reveals a truncation.
  TriangleMesh mesh;
  PolygonList faces;
  std::vector<glm::dvec2> texture_vertices;
  CheckBytesAreText(in);
  in.SkipByteOrderMark();
  while (in.at < in.data.size()) {
    const bool last_is_whole = in.data.find_first_of("\r\n", in.at) != std::string::npos;
    std::istringstream words(ObjStatement(in));
    std::string word;
    words >> word;
    if (word == "v") {
      std::string x, y, z;
      words >> x >> y >> z;
      mesh.vertices.emplace_back(NumberFrom(in, x), NumberFrom(in, y), NumberFrom(in, z));
    } else if (word == "vt") {
      std::string u, v;
      words >> u >> v;
      texture_vertices.emplace_back(NumberFrom(in, u), v.empty() ? 0.0 : NumberFrom(in, v));  // a texture may be a line
    } else if (word == "f") {
      std::vector<long> corners;
      std::vector<glm::dvec2> uv;
      while (words >> word) {
        std::istringstream parts(word);  // v, v/vt, v//vn or v/vt/vn; 1 is the first, -1 the last
        std::string vertex, texture;
        std::getline(parts, vertex, '/');
        std::getline(parts, texture, '/');
        const auto index = [&](const std::string& text, size_t count) {
          const long i = IntegerFrom(in, text);
          return i < 0 ? static_cast<long>(count) + i : i - 1;
        };
        corners.push_back(index(vertex, mesh.vertices.size()));
        if (texture.empty()) continue;
        const long t = index(texture, texture_vertices.size());
        if (t >= 0 && t < static_cast<long>(texture_vertices.size())) uv.push_back(texture_vertices[t]);
      }
      if (!last_is_whole && corners.size() < 3) BadMesh(in.file, "the file is truncated");
      faces.Add(corners, uv);
    }
  }
  AddPolygons(in.file, faces, limits.triangles, mesh);
  return mesh;
}

}  // namespace

TriangleMesh ReadMeshFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    BadMesh(file, "there is no such mesh file",
            RemedyOfMissing(file, "Check the path; it must name a file, not a folder."));
  const MeshLimits limits;
  MeshBytes in{file, ReadWholeFile(file, limits.bytes, kManyTriangles)};
  if (in.data.empty()) BadMesh(file, "the mesh file is empty");
  const std::string extension = InLowerCase(file.extension().string());
  TriangleMesh mesh;
  if (extension == ".ply")
    mesh = ReadPly(in, limits);
  else if (extension == ".stl")
    mesh = ReadStl(in);
  else if (extension == ".obj")
    mesh = ReadObj(in, limits);
  else
    BadMesh(file, "unknown mesh format '" + extension + "'", "PLY, STL and OBJ are read.");
  CheckPlaces(file, mesh.vertices);
  if (mesh.triangles.empty()) BadMesh(file, "the mesh has no triangles");
  if (static_cast<double>(mesh.triangles.size()) > limits.triangles)
    BadMesh(file, "the mesh has " + std::to_string(mesh.triangles.size()) + " triangles", kManyTriangles);
  if (mesh.corner_uv.size() != mesh.triangles.size()) mesh.corner_uv.clear();  // some faces lack them
  constexpr double kMostRepeats = 1e6;                                         // of a texture
  for (const auto& corners : mesh.corner_uv)
    for (const glm::dvec2& uv : corners)
      if (!(std::abs(uv.x) < kMostRepeats && std::abs(uv.y) < kMostRepeats))
        BadMesh(file, "a texture coordinate is not finite or beyond a million");
  return mesh;
}

}  // namespace crownfit
