#include "geometry/mesh_file.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "base/error.h"
#include "base/files.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;

[[noreturn]] void Bad(const Path& file, const std::string& message, const std::string& remedy = "") {
  throw InputError(file, "", message, remedy.empty() ? "Export the mesh again as binary PLY or STL." : remedy);
}

/// Bytes of the file with bounds-checked reading.
struct Bytes {
  const Path& file;
  std::string data;
  size_t at = 0;

  template <class T>
  T Take(bool big_endian = false) {
    if (at + sizeof(T) > data.size()) Bad(file, "the file is truncated");
    char raw[sizeof(T)];
    std::memcpy(raw, data.data() + at, sizeof(T));
    at += sizeof(T);
    if (big_endian) std::reverse(raw, raw + sizeof(T));
    return std::bit_cast<T>(raw);
  }
  std::string Line() {
    if (at >= data.size()) Bad(file, "the file is truncated");
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
    if (begin == at) Bad(file, "the file is truncated");
    return data.substr(begin, at - begin);
  }
};

double NumberFrom(const Path& file, const std::string& word) {
  double v = 0;
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), v);
  if (error != std::errc() || end != word.data() + word.size())
    Bad(file, "'" + word.substr(0, 20) + "' is not a number");
  return v;
}

void AddPolygon(const Path& file, TriangleMesh& mesh, const std::vector<long>& corners) {
  if (corners.size() < 3) Bad(file, "a face has fewer than 3 corners");
  for (long c : corners)
    if (c < 0 || c >= static_cast<long>(mesh.vertices.size()))
      Bad(file, "a face names vertex " + std::to_string(c) + ", but there are " + std::to_string(mesh.vertices.size()));
  for (size_t k = 2; k < corners.size(); ++k) mesh.triangles.emplace_back(corners[0], corners[k - 1], corners[k]);
}

/// The same fan of texture coordinates, one per corner; without them the mesh as a whole gets none.
void AddPolygonUv(TriangleMesh& mesh, const std::vector<glm::dvec2>& corners) {
  for (size_t k = 2; k < corners.size(); ++k) mesh.corner_uv.push_back({corners[0], corners[k - 1], corners[k]});
}

// ---- PLY --------------------------------------------------------------------------------------------------------

struct PlyProperty {
  std::string name, type, count_type;  ///< count_type is empty for a single number
};
struct PlyElement {
  std::string name;
  size_t count = 0;
  std::vector<PlyProperty> properties;
};

double TakePly(Bytes& in, const std::string& type, int format) {
  if (format == 0) return NumberFrom(in.file, in.Word());
  const bool big = format == 2;
  if (type == "char" || type == "int8") return in.Take<int8_t>(big);
  if (type == "uchar" || type == "uint8") return in.Take<uint8_t>(big);
  if (type == "short" || type == "int16") return in.Take<int16_t>(big);
  if (type == "ushort" || type == "uint16") return in.Take<uint16_t>(big);
  if (type == "int" || type == "int32") return in.Take<int32_t>(big);
  if (type == "uint" || type == "uint32") return in.Take<uint32_t>(big);
  if (type == "float" || type == "float32") return in.Take<float>(big);
  if (type == "double" || type == "float64") return in.Take<double>(big);
  Bad(in.file, "unknown PLY type '" + type + "'");
}

TriangleMesh ReadPly(Bytes& in) {
  if (in.Line() != "ply") Bad(in.file, "not a PLY file: it does not start with 'ply'");
  int format = -1;
  std::vector<PlyElement> elements;
  for (std::string line = in.Line(); line != "end_header"; line = in.Line()) {
    std::istringstream words(line);
    std::string word, a, b, c, d;
    words >> word >> a;
    if (word == "format") {
      format = a == "ascii" ? 0 : a == "binary_little_endian" ? 1 : a == "binary_big_endian" ? 2 : -1;
    } else if (word == "element") {
      words >> b;
      const double count = NumberFrom(in.file, b);
      if (!(count >= 0 && count < 5e7)) Bad(in.file, "element " + a + " has an impossible count");
      elements.push_back({a, static_cast<size_t>(count), {}});
    } else if (word == "property") {
      if (elements.empty()) Bad(in.file, "a property stands before any element");
      words >> b >> c >> d;
      if (a == "list") {
        elements.back().properties.push_back({d, c, b});
      } else {
        elements.back().properties.push_back({b, a, ""});
      }
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      Bad(in.file, "unknown PLY header line '" + line.substr(0, 40) + "'");
    }
  }
  if (format < 0) Bad(in.file, "the PLY header has no known format line");
  TriangleMesh mesh;
  for (const PlyElement& element : elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    for (size_t i = 0; i < element.count; ++i) {
      glm::dvec3 position(0.0);
      for (const PlyProperty& p : element.properties) {
        if (p.count_type.empty()) {
          const double v = TakePly(in, p.type, format);
          if (!is_vertex) continue;
          if (p.name == "x")
            position.x = v;
          else if (p.name == "y")
            position.y = v;
          else if (p.name == "z")
            position.z = v;
          else
            mesh.vertex_properties[p.name].push_back(v);
          continue;
        }
        const double count = TakePly(in, p.count_type, format);
        if (!(count >= 0 && count <= 1000)) Bad(in.file, "a list has an impossible length");
        std::vector<double> list;
        for (int k = 0; k < static_cast<int>(count); ++k) list.push_back(TakePly(in, p.type, format));
        if (!is_face) continue;
        if (p.name == "vertex_indices" || p.name == "vertex_index")
          AddPolygon(in.file, mesh, {list.begin(), list.end()});
        if (p.name == "texcoord") {
          std::vector<glm::dvec2> uv;
          for (size_t k = 0; k + 1 < list.size(); k += 2) uv.emplace_back(list[k], list[k + 1]);
          AddPolygonUv(mesh, uv);
        }
      }
      if (is_vertex) mesh.vertices.push_back(position);
    }
  }
  if (!mesh.corner_uv.empty()) return mesh;
  for (const auto& [u, v] : {std::pair{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}) {
    const auto us = mesh.vertex_properties.find(u), vs = mesh.vertex_properties.find(v);
    if (us == mesh.vertex_properties.end() || vs == mesh.vertex_properties.end()) continue;
    const auto at = [&](int i) { return glm::dvec2(us->second[i], vs->second[i]); };
    for (const glm::ivec3& t : mesh.triangles) mesh.corner_uv.push_back({at(t.x), at(t.y), at(t.z)});
    break;
  }
  return mesh;
}

// ---- STL, OBJ ---------------------------------------------------------------------------------------------------

TriangleMesh ReadStl(Bytes& in) {
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
      Bad(in.file, "neither an ASCII STL nor a binary STL of the length its count asks for (truncated?)");
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
    if (!ended || mesh.vertices.size() % 3) Bad(in.file, "the file is truncated");
  }
  for (size_t i = 0; i + 2 < mesh.vertices.size(); i += 3) mesh.triangles.emplace_back(i, i + 1, i + 2);
  return mesh;
}

TriangleMesh ReadObj(Bytes& in) {
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
          const long i = static_cast<long>(NumberFrom(in.file, text));
          return i < 0 ? static_cast<long>(count) + i : i - 1;
        };
        corners.push_back(index(vertex, mesh.vertices.size()));
        if (texture.empty()) continue;
        const long t = index(texture, texture_vertices.size());
        if (t >= 0 && t < static_cast<long>(texture_vertices.size())) uv.push_back(texture_vertices[t]);
      }
      if (uv.size() == corners.size()) AddPolygonUv(mesh, uv);
      if (!last_is_whole && corners.size() < 3) Bad(in.file, "the file is truncated");
      AddPolygon(in.file, mesh, corners);
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh ReadMeshFile(const Path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    Bad(file, "there is no such mesh file", "Check the path; a folder is not a mesh.");
  std::ifstream stream(file, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  Bytes in{file, text.str()};
  if (in.data.empty()) Bad(file, "the mesh file is empty");
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  TriangleMesh mesh;
  if (extension == ".ply")
    mesh = ReadPly(in);
  else if (extension == ".stl")
    mesh = ReadStl(in);
  else if (extension == ".obj")
    mesh = ReadObj(in);
  else
    Bad(file, "unknown mesh format '" + extension + "'", "PLY, STL and OBJ are read.");
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    const glm::dvec3& v = mesh.vertices[i];
    if (!std::isfinite(v.x) || !std::isfinite(v.y) || !std::isfinite(v.z))
      Bad(file, "vertex " + std::to_string(i) + " is not finite (NaN or infinity)");
  }
  if (mesh.triangles.empty()) Bad(file, "the mesh has no triangles");
  if (mesh.corner_uv.size() != mesh.triangles.size()) mesh.corner_uv.clear();  // only a part has them
  return mesh;
}

void WritePly(const Path& file, const TriangleMesh& mesh) {
  std::ostringstream out;
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << mesh.vertices.size()
      << "\nproperty float x\nproperty float y\nproperty float z\n";
  for (const auto& [name, values] : mesh.vertex_properties) out << "property double " << name << "\n";
  out << "element face " << mesh.triangles.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto put = [&](auto v) { out.write(reinterpret_cast<const char*>(&v), sizeof v); };
  for (size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (int k = 0; k < 3; ++k) put(static_cast<float>(mesh.vertices[i][k]));
    for (const auto& [name, values] : mesh.vertex_properties) put(values[i]);
  }
  for (const auto& t : mesh.triangles) {
    put(static_cast<uint8_t>(3));
    for (int k = 0; k < 3; ++k) put(static_cast<int32_t>(t[k]));
  }
  WriteTextFile(file, out.str());
}

}  // namespace crownfit
