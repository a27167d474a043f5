#include <algorithm>
#include <cmath>
#include <cstring>
#include <sstream>

#include "base/files.h"
#include "exchange/equivalents.h"
#include "exchange/exporters.h"

// glTF 2.0 in a .glb. Metres; a camera looks along -z with y up.

namespace crownfit {
namespace {

constexpr double kMetres = 1e-3;

JsonValue Rgb(const Spectrum& v) { return v.list(); }

/// Shares of light that enters at the front and is reflected or transmitted, for a flat sample of the layers. (1 - f)
/// base = reflectance and f colour x attenuation = transmittance, both without the surface's specular reflection.
JsonValue::Object MaterialJson(const ExportScene& scene) {
  const Translucency t = TranslucencyOf(scene);
  const Spectrum entered(1.0 / (1.0 - t.specular)), one(1.0);
  const Spectrum back = entered * t.reflectance, through = entered * t.transmittance,
                 clear = t.thickness_mm ? entered * t.transmittance_without_absorption
                                        : Spectrum(t.reflectance.size(), 0.0);
  const auto largest = [](const Spectrum& v) { return v.Largest(); };
  // As large as transmission needs, as long as base stays at most 1 in every channel.
  const double sum = largest(back) + largest(clear),
               share = std::min(sum > 0 ? largest(clear) / sum : 0.0, std::max(0.0, 1.0 - largest(back)));
  const Spectrum base = share < 1 ? Min(back / (1.0 - share), one) : Spectrum(t.reflectance.size(), 0.0);
  JsonValue::Object extensions{
      {"KHR_materials_ior", JsonValue::Object{{"ior", scene.layers[0].ior / scene.outside_ior}}}};
  if (t.thickness_mm) {
    extensions.emplace_back(
        "KHR_materials_diffuse_transmission",
        JsonValue::Object{{"diffuseTransmissionFactor", share},
                          {"diffuseTransmissionColorFactor", Rgb(Min(clear / std::max(share, 1e-12), one))}});
    const double thickness = *t.thickness_mm * kMetres;
    extensions.emplace_back("KHR_materials_volume",
                            JsonValue::Object{{"thicknessFactor", thickness},
                                              {"attenuationDistance", thickness},
                                              {"attenuationColor", Rgb(Min(through / clear, one))}});
  }
  return {{"name", "crown"},
          {"pbrMetallicRoughness",
           JsonValue::Object{{"baseColorFactor", std::vector<double>{base[0], base[1], base[2], 1.0}},
                             {"metallicFactor", 0.0},
                             {"roughnessFactor", std::sqrt(scene.roughness)}}},
          {"extensions", extensions}};
}

/// Positions, then normals, of three corners per triangle.
std::string Corners(const TriangleMesh& mesh) {
  std::string bytes;
  const auto put = [&](const glm::dvec3& v) {
    const float numbers[3] = {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    bytes.append(reinterpret_cast<const char*>(numbers), sizeof numbers);
  };
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) put(kMetres * mesh.vertices[t[k]]);
  for (const auto& normals : CornerNormals(mesh))
    for (const glm::dvec3& n : normals) put(n);
  return bytes;
}

void AddMesh(const TriangleMesh& mesh, size_t bytes, JsonValue::Object& root) {
  const double corners = 3.0 * static_cast<double>(mesh.triangles.size()), half = static_cast<double>(bytes) / 2;
  const auto [low, high] = Bounds(mesh);
  const auto single = [](const glm::dvec3& v) {  // rounded as in the buffer
    JsonValue::Array list;
    for (int k = 0; k < 3; ++k) list.emplace_back(static_cast<double>(static_cast<float>(kMetres * v[k])));
    return list;
  };
  constexpr int kFloat = 5126, kVertices = 34962, kTriangles = 4;
  const auto view = [&](double offset) {
    return JsonValue::Object{{"buffer", 0}, {"byteOffset", offset}, {"byteLength", half}, {"target", kVertices}};
  };
  root.emplace_back("buffers", JsonValue::Array{JsonValue::Object{{"byteLength", 2 * half}}});
  root.emplace_back("bufferViews", JsonValue::Array{view(0), view(half)});
  root.emplace_back(
      "accessors",
      JsonValue::Array{
          JsonValue::Object{{"bufferView", 0},
                            {"componentType", kFloat},
                            {"count", corners},
                            {"type", "VEC3"},
                            {"min", single(low)},
                            {"max", single(high)}},
          JsonValue::Object{{"bufferView", 1}, {"componentType", kFloat}, {"count", corners}, {"type", "VEC3"}}});
  root.emplace_back("meshes", JsonValue::Array{JsonValue::Object{
                                  {"name", "crown"},
                                  {"primitives", JsonValue::Array{JsonValue::Object{
                                                     {"attributes", JsonValue::Object{{"POSITION", 0}, {"NORMAL", 1}}},
                                                     {"material", 0},
                                                     {"mode", kTriangles}}}}}});
}

void AddScene(const ExportScene& scene, JsonValue::Object& root) {
  JsonValue::Array nodes{JsonValue::Object{{"name", "crown"}, {"mesh", 0}}}, cameras, numbers;
  numbers.emplace_back(0);
  for (const ExportedPhotograph& photo : scene.photographs) {
    const Camera& c = photo.camera;
    cameras.push_back(
        JsonValue::Object{{"name", photo.name},
                          {"type", "perspective"},
                          {"perspective", JsonValue::Object{{"aspectRatio", static_cast<double>(c.width) / c.height},
                                                            {"yfov", 2.0 * std::atan(0.5 * c.height / c.fy)},
                                                            {"znear", 0.001}}}});
    const RigidTransform back = photo.camera_from_object.Inverse();
    const glm::dvec3 x = back.rotation[0], y = -back.rotation[1], z = -back.rotation[2],
                     o = kMetres * back.translation_mm;
    nodes.push_back(JsonValue::Object{
        {"name", photo.name},
        {"camera", static_cast<int>(cameras.size()) - 1},
        {"matrix", std::vector<double>{x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, o.x, o.y, o.z, 1}}});
    numbers.push_back(static_cast<int>(nodes.size()) - 1);
  }
  if (!cameras.empty()) root.emplace_back("cameras", cameras);
  root.emplace_back("nodes", nodes);
  root.emplace_back("scenes", JsonValue::Array{JsonValue::Object{{"nodes", numbers}}});
  root.emplace_back("scene", 0);
}

void PutNumber(std::string& bytes, size_t number) {
  const auto v = static_cast<uint32_t>(number);
  char raw[4];
  std::memcpy(raw, &v, sizeof v);
  bytes.append(raw, 4);
}

/// `type`: four characters, which may include a closing zero.
std::string Chunk(const char* type, std::string bytes, char padding) {
  bytes.resize((bytes.size() + 3) / 4 * 4, padding);
  std::string chunk;
  PutNumber(chunk, bytes.size());
  return chunk.append(type, 4) + bytes;
}

}  // namespace

void WriteGltf(const ExportScene& scene, const std::filesystem::path& folder) {
  const JsonValue::Object material = MaterialJson(scene);
  JsonValue::Array used;
  for (const auto& [name, value] : std::get<JsonValue::Object>(material.back().second.data)) used.emplace_back(name);
  JsonValue::Object root{{"asset", JsonValue::Object{{"version", "2.0"}, {"generator", "crownfit"}}},
                         {"extensionsUsed", used},
                         {"materials", JsonValue::Array{material}}};
  std::string corners;
  if (!scene.surfaces.empty()) {
    corners = Corners(scene.surfaces[0]);
    AddMesh(scene.surfaces[0], corners.size(), root);
    AddScene(scene, root);
  }
  std::string chunks = Chunk("JSON", ToJsonText(root), ' ');
  if (!corners.empty()) chunks += Chunk("BIN", corners, '\0');
  std::string glb = "glTF";
  PutNumber(glb, 2);
  PutNumber(glb, 12 + chunks.size());
  WriteTextFile(folder / "crown.glb", glb + chunks);
}

}  // namespace crownfit
