#include "geometry/mesh_file.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "base/files.h"
#include "geometry/mesh_bytes.h"

namespace crownfit {
namespace {

constexpr double kFarthest_mm = 1e5;  // rays are single precision: a step of 0.008 mm there

long IntegerFrom(const std::filesystem::path& file, const std::string& word) {
  long v = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), v);
  if (error != std::errc() || end != word.data() + word.size())
    BadMesh(file, "'" + word.substr(0, 20) + "' is not a vertex number");
  return v;
}

TriangleMesh ReadStl(MeshBytes& in) {
  TriangleMesh mesh;
  const auto corner = [&](const glm::dvec3& p) { mesh.vertices.push_back(p); };
  uint32_t count = 0;
  if (in.data.size() >= 84) std::memcpy(&count, in.data.data() + 80, 4);
  const bool binary = in.data.size() >= 84 && in.data.size() == 84 + 50ull * count;
  if (binary) {
    in.at = 84;
    for (uint32_t i = 0; i < count; ++i) {
      in.at += 12;
      for (int k = 0; k < 3; ++k) {
        const float x = in.Take<float>(), y = in.Take<float>(), z = in.Take<float>();
        corner({x, y, z});
      }
      in.at += 2;
    }
  } else {
    if (!in.data.starts_with("solid"))
      BadMesh(
          in.file,
          "neither an ASCII STL nor a binary STL of the length that its triangle count requires; it may be truncated");
    bool ended = false;
    while (in.at < in.data.size() && !ended) {
      std::istringstream words(in.Line());
      std::string word, x, y, z;
      words >> word;
      if (word == "vertex") {
        words >> x >> y >> z;
        corner({NumberFrom(in.file, x), NumberFrom(in.file, y), NumberFrom(in.file, z)});
      }
      ended = word == "endsolid";
    }
    if (!ended || mesh.vertices.size() % 3) BadMesh(in.file, "the file is truncated");
  }
  for (size_t i = 0; i + 2 < mesh.vertices.size(); i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

TriangleMesh ReadObj(MeshBytes& in, const MeshLimits& limits) {
  // The text form has no count, so a cut inside the last line is all that can be seen of a truncation.
  TriangleMesh mesh;
  std::vector<glm::dvec2> texture_vertices;
  while (in.at < in.data.size()) {
    const bool last_is_whole = in.data.find('\n', in.at) != std::string::npos;
    std::istringstream words(in.Line());
    std::string word;
    words >> word;
    if (word == "v") {
      std::string x, y, z;
      words >> x >> y >> z;
      mesh.vertices.emplace_back(NumberFrom(in.file, x), NumberFrom(in.file, y), NumberFrom(in.file, z));
    } else if (word == "vt") {
      std::string u, v;
      words >> u >> v;
      texture_vertices.emplace_back(NumberFrom(in.file, u), NumberFrom(in.file, v));
    } else if (word == "f") {
      std::vector<long> corners;
      std::vector<glm::dvec2> uv;
      while (words >> word) {
        std::istringstream parts(word);  // v, v/vt, v//vn or v/vt/vn; 1 is the first, -1 the last
        std::string vertex, texture;
        std::getline(parts, vertex, '/');
        std::getline(parts, texture, '/');
        const auto index = [&](const std::string& text, size_t count) {
          const long i = IntegerFrom(in.file, text);
          return i < 0 ? static_cast<long>(count) + i : i - 1;
        };
        corners.push_back(index(vertex, mesh.vertices.size()));
        if (texture.empty()) continue;
        const long t = index(texture, texture_vertices.size());
        if (t >= 0 && t < static_cast<long>(texture_vertices.size())) uv.push_back(texture_vertices[t]);
      }
      if (uv.size() == corners.size()) AddPolygonUv(mesh, uv);
      if (!last_is_whole && corners.size() < 3) BadMesh(in.file, "the file is truncated");
      AddPolygon(in.file, mesh, corners, limits.triangles);
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh ReadMeshFile(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    BadMesh(file, "there is no such mesh file", "Check the path; it must name a file, not a folder.");
  const MeshLimits limits;
  MeshBytes in{file, ReadWholeFile(file, limits.bytes, kManyTriangles)};
  if (in.data.empty()) BadMesh(file, "the mesh file is empty");
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  TriangleMesh mesh;
  if (extension == ".ply")
    mesh = ReadPly(in, limits);
  else if (extension == ".stl")
    mesh = ReadStl(in);
  else if (extension == ".obj")
    mesh = ReadObj(in, limits);
  else
    BadMesh(file, "unknown mesh format '" + extension + "'", "PLY, STL and OBJ are read.");
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const glm::dvec3& v = mesh.vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      BadMesh(file, "vertex " + std::to_string(i) + " is not finite (NaN or infinity)");
    if (glm::length(v) > kFarthest_mm)
      BadMesh(file, "vertex " + std::to_string(i) + " lies more than 100 m from the origin", "Meshes are in mm.");
  }
  if (mesh.triangles.empty()) BadMesh(file, "the mesh has no triangles");
  if (static_cast<double>(mesh.triangles.size()) > limits.triangles)
    BadMesh(file, "the mesh has " + std::to_string(mesh.triangles.size()) + " triangles", kManyTriangles);
  if (mesh.corner_uv.size() != mesh.triangles.size()) mesh.corner_uv.clear();  // only a part has them
  constexpr double kMostRepeats = 1e6;                                         // of a texture
  for (const auto& corners : mesh.corner_uv)
    for (const glm::dvec2& uv : corners)
      if (!(std::abs(uv.x) < kMostRepeats && std::abs(uv.y) < kMostRepeats))
        BadMesh(file, "a texture coordinate is not finite or beyond a million");
  return mesh;
}

}  // namespace crownfit
