// PLY: text and binary, with the properties of its vertices.

#include <cmath>
#include <cstdint>
#include <sstream>

#include "base/files.h"
#include "geometry/mesh_bytes.h"
#include "geometry/mesh_file.h"

namespace crownfit {
namespace {

struct PlyProperty {
  std::string name, type, count_type;  ///< count_type is empty for a single number
};
struct PlyElement {
  std::string name;
  size_t count = 0;
  std::vector<PlyProperty> properties;
};

/// Bytes of a number of this type; 0: unknown.
size_t PlySize(const std::string& type) {
  if (type == "char" || type == "int8" || type == "uchar" || type == "uint8") return 1;
  if (type == "short" || type == "int16" || type == "ushort" || type == "uint16") return 2;
  if (type == "int" || type == "int32" || type == "uint" || type == "uint32" || type == "float" || type == "float32")
    return 4;
  return type == "double" || type == "float64" ? 8 : 0;
}

double TakePly(MeshBytes& in, const std::string& type, int format) {
  if (format == 0) return NumberFrom(in, in.Word());
  const bool big = format == 2;
  if (type == "char" || type == "int8") return in.Take<int8_t>(big);
  if (type == "uchar" || type == "uint8") return in.Take<uint8_t>(big);
  if (type == "short" || type == "int16") return in.Take<int16_t>(big);
  if (type == "ushort" || type == "uint16") return in.Take<uint16_t>(big);
  if (type == "int" || type == "int32") return in.Take<int32_t>(big);
  if (type == "uint" || type == "uint32") return in.Take<uint32_t>(big);
  if (type == "float" || type == "float32") return in.Take<float>(big);
  if (type == "double" || type == "float64") return in.Take<double>(big);
  BadMesh(in.file, "unknown PLY type '" + type + "'");
}

constexpr size_t kMostInHeader = 1000;  // elements, or properties of one: each is compared with all before it

struct PlyHeader {
  int format = -1;  ///< 0 text, 1 binary little-endian, 2 big-endian
  std::vector<PlyElement> elements;
};

PlyHeader ReadPlyHeader(MeshBytes& in) {
  const auto next_line = [&] {
    std::string line = in.Line();
    line.erase(line.find_last_not_of(" \t") + 1);
    return line;
  };
  in.SkipByteOrderMark();
  if (next_line() != "ply") BadMesh(in.file, "not a PLY file: it does not start with 'ply'");
  PlyHeader header;
  auto& [format, elements] = header;
  for (std::string line = next_line(); line != "end_header"; line = next_line()) {
    std::istringstream words(line);
    std::string word, a, b, c, d;
    words >> word >> a;
    if (word == "format") {
      format = a == "ascii" ? 0 : a == "binary_little_endian" ? 1 : a == "binary_big_endian" ? 2 : -1;
    } else if (word == "element") {
      words >> b;
      const double count = NumberFrom(in, b);
      if (!(count >= 0 && count < 1e9 && count == std::floor(count)))
        BadMesh(in.file, "element " + a.substr(0, 40) + " has an impossible count");
      for (const PlyElement& other : elements)
        if (other.name == a) BadMesh(in.file, "element " + a.substr(0, 40) + " occurs twice in the header");
      if (elements.size() >= kMostInHeader) BadMesh(in.file, "the header names too many elements");
      elements.push_back({a, static_cast<size_t>(count), {}});
    } else if (word == "property") {
      if (elements.empty()) BadMesh(in.file, "a property comes before the first element");
      words >> b >> c >> d;
      const PlyProperty added = a == "list" ? PlyProperty{d, c, b} : PlyProperty{b, a, ""};
      for (const PlyProperty& other : elements.back().properties)
        if (other.name == added.name)
          BadMesh(in.file, "property " + added.name.substr(0, 40) + " occurs twice in the header");
      if (PlySize(added.type) == 0 || (a == "list" && PlySize(added.count_type) == 0))
        BadMesh(in.file, "unknown PLY type in '" + line.substr(0, 40) + "'");
      if (elements.back().properties.size() >= kMostInHeader) BadMesh(in.file, "the header names too many properties");
      elements.back().properties.push_back(added);
    } else if (word != "comment" && word != "obj_info" && !word.empty()) {
      BadMesh(in.file, "unknown PLY header line '" + line.substr(0, 40) + "'");
    }
  }
  if (format < 0) BadMesh(in.file, "the PLY header has no known format line");
  return header;
}

/// The least size of one item of an element in the file; as many as the header counts must fit into the file.
size_t LeastBytes(const PlyElement& element, int format) {
  size_t bytes = 0;
  for (const PlyProperty& p : element.properties)
    bytes += format == 0 ? 2 : PlySize(p.count_type.empty() ? p.type : p.count_type);
  return bytes;
}

bool IsCornerList(const PlyProperty& p) {
  return !p.count_type.empty() && (p.name == "vertex_indices" || p.name == "vertex_index");
}

/// Throws InputError where faces could not be read by their corners.
void CheckFaces(const MeshBytes& in, const PlyElement& faces) {
  if (faces.count == 0 || std::any_of(faces.properties.begin(), faces.properties.end(), IsCornerList)) return;
  std::string others;
  for (const PlyProperty& p : faces.properties) others += (others.empty() ? "" : ", ") + p.name.substr(0, 40);
  BadMesh(in.file,
          "its faces lack the list property vertex_indices, or vertex_index" +
              (others.empty() ? "" : "; they have " + others.substr(0, 200)),
          "Name the list of each face's corners so in the header, or export the mesh again.");
}

/// Throws InputError where data follow that the header does not count: they may be faces. White space and zeros may.
void CheckEnd(const MeshBytes& in, const std::vector<PlyElement>& elements) {
  const size_t first = in.data.find_first_not_of(std::string(" \t\r\n\0", 5), in.at);
  if (first == in.data.npos) return;
  std::string counted;
  for (const PlyElement& e : elements)
    if (e.name == "vertex" || e.name == "face")
      counted += (counted.empty() ? "" : " and ") + std::to_string(e.count) + " of element " + e.name;
  BadMesh(in.file, "the header counts " + counted + ", but " + std::to_string(in.data.size() - first) +
                       " bytes follow the last of them");
}

}  // namespace

TriangleMesh ReadPly(MeshBytes& in, const MeshLimits& limits) {
  const auto [format, elements] = ReadPlyHeader(in);
  TriangleMesh mesh;
  PolygonList faces;
  for (const PlyElement& element : elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    const auto has = [&](const char* name) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const PlyProperty& p) { return p.name == name && p.count_type.empty(); });
    };
    if (is_vertex && !(has("x") && has("y") && has("z"))) BadMesh(in.file, "its vertices lack x, y or z");
    if (is_vertex)
      for (const PlyProperty& p : element.properties)
        if (p.count_type.empty() && (p.type == "uchar" || p.type == "uint8")) mesh.byte_properties.insert(p.name);
    if (is_face) CheckFaces(in, element);
    const size_t least = LeastBytes(element, format);  // the last number of a text may lack its separator
    if (element.count > 0 && (least == 0 || element.count > (in.data.size() - in.at + 1) / least))
      BadMesh(in.file, "the file is truncated: it has no room for " + std::to_string(element.count) + " of element " +
                           element.name.substr(0, 40));
    for (size_t i = 0; i < element.count; ++i) {
      glm::dvec3 position(0.0);
      std::vector<long> corners;
      std::vector<glm::dvec2> uv;
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
        if (!(count >= 0 && count <= 1000 && count == std::floor(count)))
          BadMesh(in.file, "a list has an impossible length");
        std::vector<double> list;
        for (int k = 0; k < static_cast<int>(count); ++k) list.push_back(TakePly(in, p.type, format));
        if (!is_face) continue;
        if (IsCornerList(p)) {
          for (double v : list) {
            if (!(std::abs(v) < 1e15 && v == std::floor(v)))
              BadMesh(in.file, "a face names a vertex by a value that is not a whole number");
            corners.push_back(static_cast<long>(v));
          }
        }
        if (p.name == "texcoord")
          for (size_t k = 0; k + 1 < list.size(); k += 2) uv.emplace_back(list[k], list[k + 1]);
      }
      if (is_vertex) mesh.vertices.push_back(position);
      if (is_face) faces.Add(corners, uv);
    }
  }
  CheckEnd(in, elements);
  AddPolygons(in.file, faces, limits.triangles, mesh);
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

void WritePly(const std::filesystem::path& file, const TriangleMesh& mesh) {
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
