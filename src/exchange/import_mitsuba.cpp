#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "exchange/export_scene.h"
#include "exchange/mitsuba_scene.h"
#include "geometry/mesh_file.h"

// What of a scene is the object: shapes with an interior medium. The boundary of the outermost one has no exterior
// medium; that of every further one names the medium outside of it.

namespace crownfit {
namespace {

using Path = std::filesystem::path;

constexpr double kMostPixels = 20000;
constexpr double kSameIndex = 1e-6;

const MitsubaNode* OnlyOne(const MitsubaPlugin& plugin, const std::string& tag) {
  const auto nested = plugin.Nested(tag);
  if (nested.size() > 1) nested[1]->Fail("is a second <" + tag + "> of " + plugin.node().Title(), "Keep one.");
  return nested.empty() ? nullptr : nested[0];
}

/// Half the width of the picture, over the focal length (perspective.cpp and sensor.cpp of Mitsuba 3).
double HalfWidth(const MitsubaPlugin& sensor, double width, double height) {
  const double aspect = width / height;
  const auto along_diagonal = [&](double tangent) { return tangent / std::sqrt(1 + 1 / (aspect * aspect)); };
  const auto fov = sensor.Number("fov", 1e-3, 179.9);
  if (!fov) {
    // Of a film of 36 mm by 24 mm, along its diagonal.
    const std::string text = sensor.Text("focal_length").value_or("50mm");
    char* end = nullptr;
    const double focal = std::strtod(text.c_str(), &end);
    const std::string rest = end;
    if (!(focal > 0 && focal < 1e6) || (!rest.empty() && rest != "mm"))
      sensor.Find("focal_length")->Fail("expected a length such as 50mm");
    return along_diagonal(0.5 * std::hypot(36.0, 24.0) / focal);
  }
  if (sensor.Find("focal_length")) sensor.node().Fail("has both fov and focal_length", "Keep one.");
  const double tangent = std::tan(0.5 * *fov * std::numbers::pi / 180.0);
  std::string axis = sensor.Text("fov_axis").value_or("x");
  if (axis == "smaller") axis = width > height ? "y" : "x";
  if (axis == "larger") axis = width > height ? "x" : "y";
  if (axis == "x") return tangent;
  if (axis == "y") return tangent * aspect;
  if (axis != "diagonal")
    sensor.Find("fov_axis")->Fail("expected x, y, diagonal, smaller or larger", "State one of them.");
  return along_diagonal(tangent);
}

Camera CameraOf(const MitsubaPlugin& sensor) {
  const MitsubaNode* film_node = OnlyOne(sensor, "film");
  if (!film_node) sensor.node().Fail("has no <film>", "State its width and height: the size of the photograph.");
  if (film_node->type != "hdrfilm")
    film_node->Fail("a film of this kind has no equivalent in a capture", "Use hdrfilm.");
  const MitsubaPlugin film(
      sensor.document(), *film_node,
      {"width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y", "file_format", "pixel_format",
       "component_format", "sample_border", "compensate", "banner", "<rfilter>"});
  const int most = static_cast<int>(kMostPixels);
  const int width = film.Integer("width", 768, 1, most), height = film.Integer("height", 576, 1, most);
  const int left = film.Integer("crop_offset_x", 0, 0, width - 1),
            top = film.Integer("crop_offset_y", 0, 0, height - 1);
  Camera camera;
  camera.width = film.Integer("crop_width", width - left, 1, width - left);
  camera.height = film.Integer("crop_height", height - top, 1, height - top);
  camera.fx = camera.fy = 0.5 * width / HalfWidth(sensor, width, height);
  camera.cx = (0.5 - sensor.Number("principal_point_offset_x", -100.0, 100.0).value_or(0.0)) * width - left;
  camera.cy = (0.5 - sensor.Number("principal_point_offset_y", -100.0, 100.0).value_or(0.0)) * height - top;
  return camera;
}

/// Mitsuba's camera looks along +z with x to the left and y up; ours has x to the right and y down.
ImportedView ViewOf(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit) {
  if (node.type != "perspective")
    node.Fail("a sensor of this kind has no equivalent in a capture", "Use a perspective sensor.");
  const MitsubaPlugin sensor(
      document, node,
      {"fov", "fov_axis", "focal_length", "principal_point_offset_x", "principal_point_offset_y", "near_clip",
       "far_clip", "to_world", "shutter_open", "shutter_close", "<film>", "<sampler>"});
  const glm::dmat4 to_world = sensor.ToWorld();
  const auto axes = RotationNear(glm::dmat3(to_world));
  if (!axes) node.Fail("to_world must turn and shift the camera only", "Remove what scales or mirrors it.");
  const RigidTransform world_from_camera{{-(*axes)[0], -(*axes)[1], (*axes)[2]}, unit.mm * glm::dvec3(to_world[3])};
  return {node.id, CameraOf(sensor), world_from_camera.Inverse()};
}

/// Henyey-Greenstein's mean cosine, and the share of isotropic scattering beside it.
struct Phase {
  double asymmetry = 0, isotropic = 0;
};

Phase SimplePhaseOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "isotropic") return MitsubaPlugin(document, node, {}), Phase{0, 1};
  if (node.type != "hg")
    node.Fail("a phase function of this kind has no equivalent in a capture", "Known: hg, isotropic, and their blend.");
  return {MitsubaPlugin(document, node, {"g"}).Number("g", -0.99, 0.999).value_or(0.8), 0};
}

Phase PhaseOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "isotropic") return SimplePhaseOf(document, node), Phase{};
  if (node.type != "blendphase") return SimplePhaseOf(document, node);
  const MitsubaPlugin blend(document, node, {"weight", "<phase>"});
  const auto parts = blend.Nested("phase");
  const auto weight = blend.Number("weight", 0.0, 1.0);  // of the second one
  if (parts.size() != 2 || !weight) node.Fail("expected a weight and two phase functions");
  const Phase first = SimplePhaseOf(document, *parts[0]), second = SimplePhaseOf(document, *parts[1]);
  if (first.isotropic == second.isotropic)
    node.Fail("has no equivalent in a capture", "Blend one hg with one isotropic phase function.");
  return {first.asymmetry + second.asymmetry, second.isotropic == 1 ? *weight : 1 - *weight};
}

/// The layer of a medium, as yet without surface and index.
ImportedLayer LayerOf(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit) {
  if (node.type != "homogeneous")
    node.Fail("a medium of this kind has no equivalent in a capture", "Use a homogeneous one for every layer.");
  const MitsubaPlugin medium(document, node,
                             {"sigma_t", "albedo", "scale", "sample_emitters", "has_spectral_extinction", "<phase>"});
  const auto extinction = medium.Rgb("sigma_t", 1e9), albedo = medium.Rgb("albedo", 1.0);
  if (!extinction || !albedo) node.Fail("has no sigma_t or no albedo", "State both, each as an <rgb>.");
  const MitsubaNode* phase_node = OnlyOne(medium, "phase");
  const Phase phase = phase_node ? PhaseOf(document, *phase_node) : Phase{};
  const glm::dvec3 per_mm = medium.Number("scale", 0.0, 1e9).value_or(1.0) / unit.mm * *extinction;
  ImportedLayer layer;
  layer.name = NameOfPart(medium, "medium_", "layer");
  layer.asymmetry = phase.asymmetry;
  layer.isotropic_fraction = phase.isotropic;
  layer.reduced_scattering_per_mm = per_mm * *albedo * (1.0 - (1.0 - phase.isotropic) * phase.asymmetry);
  layer.absorption_per_mm = per_mm * (1.0 - *albedo);
  return layer;
}

double IndexOf(const MitsubaPlugin& bsdf, const char* name, double otherwise) {
  // The names of ior.h of Mitsuba 3.
  static const std::map<std::string, double> known{
      {"vacuum", 1.0},      {"helium", 1.000036},        {"hydrogen", 1.000132},
      {"air", 1.000277},    {"carbon dioxide", 1.00045}, {"water", 1.3330},
      {"acetone", 1.36},    {"ethanol", 1.361},          {"carbon tetrachloride", 1.461},
      {"glycerol", 1.4729}, {"benzene", 1.501},          {"silicone oil", 1.52045},
      {"bromine", 1.661},   {"water ice", 1.31},         {"fused quartz", 1.458},
      {"pyrex", 1.470},     {"acrylic glass", 1.49},     {"polypropylene", 1.49},
      {"bk7", 1.5046},      {"sodium chloride", 1.544},  {"amber", 1.55},
      {"pet", 1.5750},      {"diamond", 2.419}};
  const MitsubaNode* node = bsdf.Find(name);
  if (!node) return otherwise;
  if (node->tag != "string") return *bsdf.Number(name, 1.0, 3.0);
  const auto found = known.find(*bsdf.Text(name));
  if (found == known.end()) node->Fail("is not known", "State the index as a <float>.");
  return found->second;
}

/// A boundary between two media.
struct Boundary {
  bool is_matched = false;  ///< the indices on both sides are equal, and not stated
  double inside = 1, outside = 1, roughness = 0;
};

/// Nothing for a BSDF that is no boundary between media.
std::optional<Boundary> BoundaryOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type == "null") return MitsubaPlugin(document, node, {}), Boundary{true};
  if (node.type != "dielectric" && node.type != "roughdielectric") return std::nullopt;
  const bool is_rough = node.type == "roughdielectric";
  std::vector<std::string> keys{"int_ior", "ext_ior", "specular_reflectance", "specular_transmittance"};
  if (is_rough) keys.insert(keys.end(), {"distribution", "alpha", "alpha_u", "alpha_v", "sample_visible"});
  const MitsubaPlugin bsdf(document, node, keys);
  for (const char* name : {"specular_reflectance", "specular_transmittance"})
    if (bsdf.Rgb(name, 1e9).value_or(glm::dvec3(1.0)) != glm::dvec3(1.0))
      bsdf.Find(name)->Fail("has no equivalent in a capture", "Leave it at 1.");
  Boundary boundary{false, IndexOf(bsdf, "int_ior", 1.5046), IndexOf(bsdf, "ext_ior", 1.000277), 0};
  if (!is_rough) return boundary;
  if (bsdf.Text("distribution").value_or("beckmann") != "ggx")
    node.Fail("has Beckmann's distribution, and a capture GGX's",
              "State <string name=\"distribution\" value=\"ggx\"/> and the alpha that looks alike.");
  const double alpha = bsdf.Number("alpha", 0.0, 1.0).value_or(0.1);
  const double along = bsdf.Number("alpha_u", 0.0, 1.0).value_or(alpha),
               across = bsdf.Number("alpha_v", 0.0, 1.0).value_or(alpha);
  if (along != across) node.Fail("alpha_u and alpha_v differ, and a capture has one roughness", "State alpha.");
  boundary.roughness = along;
  return boundary;
}

glm::dvec3 ReflectanceOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type != "diffuse")
    node.Fail("a BSDF of this kind has no equivalent in a capture",
              "Known: diffuse (also within twosided); dielectric, roughdielectric and null where a shape has an "
              "interior medium.");
  return MitsubaPlugin(document, node, {"reflectance"}).Rgb("reflectance", 1.0).value_or(glm::dvec3(0.5));
}

/// Of the outside and the inside.
std::array<glm::dvec3, 2> ReflectancesOf(const MitsubaDocument& document, const MitsubaNode& node) {
  if (node.type != "twosided") {
    const glm::dvec3 both = ReflectanceOf(document, node);
    return {both, both};
  }
  const auto sides = MitsubaPlugin(document, node, {"<bsdf>"}).Nested("bsdf");
  if (sides.empty() || sides.size() > 2) node.Fail("expected one or two BSDFs");
  return {ReflectanceOf(document, *sides.front()), ReflectanceOf(document, *sides.back())};
}

/// A shape around a medium.
struct Body {
  const MitsubaNode *shape, *interior, *exterior, *bsdf;
  std::optional<Boundary> boundary;  ///< absent: an opaque part of the surface
};

/// Bodies from the outermost one inwards.
std::vector<const Body*> Nested(const std::vector<Body>& bodies) {
  std::vector<const Body*> order;
  for (const MitsubaNode* outside = nullptr;;) {
    const Body* next = nullptr;
    for (const Body& body : bodies) {
      if (!body.boundary || body.exterior != outside) continue;
      if (next)
        body.shape->Fail("lies in the same medium as " + next->shape->Title(),
                         "A capture's layers lie one in the other: name the medium outside of each inner one as "
                         "<ref name=\"exterior\" id=\"...\"/>, and join meshes of one layer.");
      next = &body;
    }
    if (!next) break;
    order.push_back(next);
    outside = next->interior;
    if (order.size() > bodies.size()) next->shape->Fail("media lie in each other in a circle");
  }
  for (const Body& body : bodies)
    if (body.boundary && std::find(order.begin(), order.end(), &body) == order.end())
      body.shape->Fail("no other shape has its exterior medium inside",
                       "Name as exterior the medium of the layer around it, and none for the outermost.");
  return order;
}

void AddLayers(const MitsubaDocument& document, const std::vector<Body>& bodies, const MitsubaUnit& unit,
               ImportedScene& scene) {
  for (const Body* body : Nested(bodies)) {
    const MitsubaPlugin shape(document, *body->shape, KnownOfShapes());
    ImportedLayer layer = LayerOf(document, *body->interior, unit);
    const bool is_outermost = scene.layers.empty();
    const double around = is_outermost ? scene.surface.outside_ior : scene.layers.back().ior;
    if (body->boundary->is_matched) {
      layer.ior = around;
    } else {
      layer.ior = body->boundary->inside;
      if (is_outermost)
        scene.surface.outside_ior = body->boundary->outside;
      else if (std::abs(body->boundary->outside - around) > kSameIndex)
        body->bsdf->Fail("its ext_ior is not the int_ior of the layer around it", "State the same index in both.");
    }
    if (is_outermost)
      scene.surface.roughness = body->boundary->roughness;
    else if (body->boundary->roughness > 0)
      body->bsdf->Fail("an inner boundary is rough, and a capture has smooth ones", "Use dielectric.");
    layer.surface = ReadMitsubaMesh(shape, unit);
    scene.layers.push_back(std::move(layer));
  }
}

/// Opaque parts that close a layer at its neck: the capture closes open meshes by itself.
void AddNeck(const MitsubaDocument& document, const std::vector<Body>& bodies, ImportedScene& scene) {
  for (const Body& body : bodies) {
    if (body.boundary) continue;
    const auto [outside, inside] = ReflectancesOf(document, *body.bsdf);
    const bool has_layer = std::any_of(bodies.begin(), bodies.end(), [&](const Body& other) {
      return other.boundary && other.interior == body.interior && other.exterior == body.exterior;
    });
    if (body.bsdf->type != "twosided" || outside != glm::dvec3(0.0) || !has_layer)
      body.bsdf->Fail("a capture has no such surface around a medium",
                      "An opaque neck is twosided, of a black BSDF outside and a diffuse one inside.");
    if (scene.surface.neck_reflectance && *scene.surface.neck_reflectance != inside)
      body.bsdf->Fail("the layers' necks return different shares of light", "State the same reflectance for all.");
    scene.surface.neck_reflectance = inside;
  }
}

/// What shapes are: bodies, lamps or things.
void AddShape(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit,
              std::vector<Body>& bodies, ImportedScene& scene) {
  const MitsubaPlugin shape(document, node, KnownOfShapes());
  const MitsubaNode *emitter = OnlyOne(shape, "emitter"), *interior = shape.Find("interior"),
                    *exterior = shape.Find("exterior"), *bsdf = OnlyOne(shape, "bsdf");
  if (emitter) {
    if (interior) node.Fail("is a lamp around a medium, which has no equivalent in a capture", "Remove one of them.");
    scene.lights.push_back(ReadMitsubaLamp(shape, *emitter, unit));
  } else if (interior) {
    if (!bsdf) node.Fail("has a medium inside and no BSDF", "State its boundary, such as dielectric.");
    bodies.push_back({&node, interior, exterior, bsdf, BoundaryOf(document, *bsdf)});
  } else if (exterior) {
    node.Fail("has a medium outside and none inside", "Name its interior medium.");
  } else if (bsdf && BoundaryOf(document, *bsdf)) {
    bsdf->Fail("stands for a clear body without a medium, which has no equivalent in a capture",
               "Name an interior medium of its own for each layer of the object.");
  } else {
    const glm::dvec3 reflectance = bsdf ? ReflectancesOf(document, *bsdf)[0] : glm::dvec3(0.5);
    if (bsdf && ReflectancesOf(document, *bsdf)[1] != reflectance)
      bsdf->Fail("its sides differ, and scenery of a capture reflects alike on both", "State one BSDF for both.");
    scene.things.push_back({NameOfPart(shape, "thing_", "thing"), ReadMitsubaMesh(shape, unit).mesh, reflectance});
  }
}

/// Light of a spot is that of a point, as long as the object lies where its beam is even.
void RequireWithin(const std::vector<EvenCone>& cones, const ImportedScene& scene) {
  for (const EvenCone& cone : cones) {
    if (scene.layers.empty())
      cone.node->Fail("whether the object lies in its beam is not known, as the scene holds no object",
                      "Use a point emitter.");
    for (const glm::dvec3& vertex : scene.layers[0].surface.mesh.vertices) {
      const glm::dvec3 way = vertex - cone.position_mm;
      if (!(glm::dot(way, cone.axis) >= cone.cosine * glm::length(way)))
        cone.node->Fail("its beam is not even over the object, which has no equivalent in a light rig",
                        "Widen beam_width until it holds the object, or use an area emitter.");
    }
  }
}

}  // namespace

const std::vector<std::string>& KnownOfShapes() {
  static const std::vector<std::string> known{
      "filename", "to_world", "face_normals", "flip_normals", "flip_tex_coords", "center",
      "radius",   "interior", "exterior",     "<bsdf>",       "<emitter>",       "silhouette_sampling_weight"};
  return known;
}

std::string NameOfPart(const MitsubaPlugin& plugin, const std::string& prefix, const std::string& otherwise) {
  std::string name = plugin.node().id;
  if (const MitsubaNode* file = name.empty() ? plugin.Find("filename") : nullptr)
    if (const std::string* value = file->Find("value")) name = Path(*value).stem().string();
  if (name.starts_with(prefix)) name.erase(0, prefix.size());
  if (name.empty()) name = otherwise;
  return FileNames({name.substr(0, 60)})[0];
}

ImportedMesh ReadMitsubaMesh(const MitsubaPlugin& shape, const MitsubaUnit& unit) {
  const std::string& type = shape.node().type;
  const glm::dmat4 to_mm = glm::scale(glm::dmat4(1.0), glm::dvec3(unit.mm)) * shape.ToWorld();
  ImportedMesh imported;
  TriangleMesh& mesh = imported.mesh;
  if (type == "ply" || type == "obj") {
    const auto file = shape.File();
    if (!file) shape.node().Fail("has no filename");
    mesh = ReadMeshFile(*file);
    const bool has_the_ending = file->extension() == "." + type;
    if (to_mm == glm::dmat4(1.0) && has_the_ending) return imported.unchanged = *file, imported;
  } else if (type == "rectangle") {
    mesh.vertices = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  } else if (type == "cube") {
    for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back(k & 1 ? 1 : -1, k & 2 ? 1 : -1, k & 4 ? 1 : -1);
    mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  } else {
    shape.node().Fail("a shape of this kind can't be read here",
                      "Write it as a mesh: ply or obj. As lamps, spheres and disks are read too.");
  }
  for (glm::dvec3& vertex : mesh.vertices) vertex = glm::dvec3(to_mm * glm::dvec4(vertex, 1.0));
  if (type != "rectangle" && glm::determinant(glm::dmat3(to_mm)) < 0)
    for (glm::ivec3& t : mesh.triangles) std::swap(t.y, t.z);
  mesh.vertex_properties.clear();
  mesh.byte_properties.clear();
  return imported;
}

ImportedScene ReadMitsuba(const Path& file, double mm_per_unit) {
  const MitsubaDocument document(file);
  const MitsubaUnit unit{mm_per_unit};
  ImportedScene scene;
  std::vector<Body> bodies;
  std::vector<EvenCone> cones;
  static const std::vector<std::string> parts{"integrator", "bsdf", "medium", "phase", "alias", "texture", "spectrum"};
  for (const MitsubaNode& child : document.scene().children) {
    const MitsubaNode& node = document.Target(child);
    if (node.tag == "sensor")
      scene.views.push_back(ViewOf(document, node, unit));
    else if (node.tag == "shape")
      AddShape(document, node, unit, bodies, scene);
    else if (node.tag == "emitter")
      scene.lights.push_back(ReadMitsubaEmitter(document, node, unit, cones));
    else if (std::find(parts.begin(), parts.end(), node.tag) ==
             parts.end())  // those count where something refers to them
      node.Fail("is not known in a scene of Mitsuba 3", "Remove it.");
  }
  AddLayers(document, bodies, unit, scene);
  AddNeck(document, bodies, scene);
  RequireWithin(cones, scene);
  return scene;
}

}  // namespace crownfit
