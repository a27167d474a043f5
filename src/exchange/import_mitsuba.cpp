#include <algorithm>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <numbers>

#include "exchange/export_scene.h"
#include "exchange/mitsuba_materials.h"
#include "geometry/mesh_file.h"

// What of a scene is the object: shapes with an interior medium. The boundary of the outermost one has no exterior
// medium; that of every further one names the medium outside of it.

namespace crownfit {
namespace {

using Path = std::filesystem::path;

constexpr double kMostPixels = 20000;
constexpr double kSameIndex = 1e-6;

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
  const MitsubaNode* film_node = sensor.OnlyNested("film");
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
  const MitsubaNode *emitter = shape.OnlyNested("emitter"), *interior = shape.Find("interior"),
                    *exterior = shape.Find("exterior"), *bsdf = shape.OnlyNested("bsdf");
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
