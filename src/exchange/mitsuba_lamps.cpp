#include <algorithm>
#include <cmath>
#include <numbers>

#include "exchange/mitsuba_scene.h"

// A pixel of crownfit is pi x radiance, and one of Mitsuba is the radiance: lamps of Mitsuba are taken 1 / pi as
// bright. crownfit's lamps block nothing, and the camera does not see them.

namespace crownfit {
namespace {

constexpr double kInfinitelyFar_mm = 0.4 * kFarthestPlace_mm;  // an object of 10 mm sees 2.5e-4 rad of parallax
constexpr size_t kLeastCorners = 64;                           // of a round lamp: its rim is true to 1e-3
constexpr double kFlat = 1e-4;                                 // departure from a shape, of its size: single precision

/// Where a lamp stands; refused where rays no longer reach.
glm::dvec3 Place(const MitsubaPlugin& plugin, const glm::dvec3& place_mm) {
  if (!(glm::length(place_mm) <= kFarthestPlace_mm))
    plugin.node().Fail("stands farther than 100 m from the origin",
                       "Use a directional emitter, or correct --mm-per-unit.");
  return place_mm;
}

glm::dvec3 Needed(const MitsubaPlugin& plugin, const char* name) {
  const auto rgb = plugin.Rgb(name, kBrightest);
  if (!rgb) plugin.node().Fail(std::string("has no ") + name, std::string("State <rgb name=\"") + name + "\" .../>.");
  return *rgb / std::numbers::pi;
}

/// Direction of the +z axis of to_world, or the difference of places it stands for.
glm::dvec3 AxisZ(const MitsubaPlugin& plugin) {
  const glm::dvec3 axis(plugin.ToWorld()[2]);
  if (!(glm::length(axis) > 0)) plugin.node().Fail("to_world has no axis z");
  return glm::normalize(axis);
}

ImportedLight Named(const MitsubaPlugin& plugin, const LightShape& shape) {
  ImportedLight imported;
  imported.light.name = NameOfPart(plugin, "lamp_", plugin.node().type);
  imported.light.shape = shape;
  return imported;
}

ImportedLight ReadPoint(const MitsubaPlugin& point, const MitsubaUnit& unit) {
  if (point.Find("position") && point.Find("to_world")) point.node().Fail("has both position and to_world");
  const glm::dvec3 place = point.Vector("position").value_or(glm::dvec3(point.ToWorld()[3]));
  return Named(point, PointLight{Place(point, unit.mm * place), unit.mm * unit.mm * Needed(point, "intensity"), 0.0});
}

ImportedLight ReadSpot(const MitsubaPlugin& spot, const MitsubaUnit& unit, std::vector<EvenCone>& cones) {
  const double cutoff = spot.Number("cutoff_angle", 0.0, 90.0).value_or(20.0),
               beam = spot.Number("beam_width", 0.0, cutoff).value_or(0.75 * cutoff);
  const glm::dvec3 place = Place(spot, unit.mm * glm::dvec3(spot.ToWorld()[3]));
  cones.push_back({&spot.node(), place, AxisZ(spot), std::cos(beam * std::numbers::pi / 180.0)});
  return Named(spot, PointLight{place, unit.mm * unit.mm * Needed(spot, "intensity"), 0.0});
}

ImportedLight ReadDirectional(const MitsubaPlugin& sun) {
  if (sun.Find("direction") && sun.Find("to_world")) sun.node().Fail("has both direction and to_world");
  const auto stated = sun.Vector("direction");
  if (stated && !(glm::length(*stated) > 0)) sun.node().Fail("has a direction of no length");
  const glm::dvec3 way = stated ? glm::normalize(*stated) : AxisZ(sun);  // the light's own
  return Named(sun, DirectionalLight{-way, Needed(sun, "irradiance"), 0.0});
}

ImportedLight ReadEnvironment(const MitsubaPlugin& map) {
  const auto file = map.File();
  if (!file) map.node().Fail("has no filename");
  glm::dmat3 turn(map.ToWorld());
  const auto rotation = RotationNear(turn);
  if (!rotation) map.node().Fail("to_world must be a rotation", "Turn the picture, and do not mirror or scale it.");
  const double scale = map.Number("scale", 0.0, kBrightest).value_or(1.0) / std::numbers::pi;
  ImportedLight imported =
      Named(map, EnvironmentLight{ReadEnvironmentMap(*file), glm::dvec3(scale), glm::transpose(*rotation)});
  imported.picture = *file;
  return imported;
}

/// Distinct places among the corners of a flat mesh.
std::vector<glm::dvec3> DistinctCorners(const TriangleMesh& mesh, double tolerance) {
  std::vector<glm::dvec3> corners;
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& corner = mesh.vertices[t[k]];
      if (std::none_of(corners.begin(), corners.end(),
                       [&](const glm::dvec3& other) { return glm::distance(corner, other) < tolerance; }))
        corners.push_back(corner);
    }
  return corners;
}

/// A mesh that lies in a plane: what it says of its shape.
struct FlatMesh {
  double area = 0, extent = 0;
  glm::dvec3 centre{0.0}, normal{0.0};  ///< of gravity; the side of counter-clockwise corners
  std::vector<glm::dvec3> corners;
};

std::optional<FlatMesh> FlatOf(const TriangleMesh& mesh) {
  constexpr size_t kMostTriangles = 4096;
  if (mesh.triangles.empty() || mesh.triangles.size() > kMostTriangles) return std::nullopt;
  FlatMesh flat;
  glm::dvec3 sum(0.0);
  double absolute = 0;
  const auto [low, high] = Bounds(mesh);
  flat.extent = glm::length(high - low);
  const glm::dvec3 middle = 0.5 * (low + high);
  for (const glm::ivec3& t : mesh.triangles) {
    const glm::dvec3 a = mesh.vertices[t.x] - middle, b = mesh.vertices[t.y] - middle, c = mesh.vertices[t.z] - middle;
    const glm::dvec3 area = 0.5 * glm::cross(b - a, c - a);
    sum += area, absolute += glm::length(area);
    flat.centre += glm::length(area) * (a + b + c) / 3.0;
  }
  flat.area = glm::length(sum);
  if (!(flat.area > 0) || flat.area < (1 - kFlat) * absolute) return std::nullopt;
  flat.normal = sum / flat.area;
  flat.centre = middle + flat.centre / absolute;
  flat.corners = DistinctCorners(mesh, kFlat * flat.extent);
  for (const glm::dvec3& corner : flat.corners)
    if (std::abs(glm::dot(corner - flat.centre, flat.normal)) > kFlat * flat.extent) return std::nullopt;
  return flat;
}

std::optional<LightShape> RectangleOf(const FlatMesh& flat, const glm::dvec3& radiance) {
  if (flat.corners.size() != 4) return std::nullopt;
  // Seen from the centre of a parallelogram, every corner has an opposite one, and neighbours span its half axes.
  std::vector<glm::dvec3> arms;
  for (const glm::dvec3& corner : flat.corners) arms.push_back(corner - flat.centre);
  size_t opposite = 0;
  for (size_t k = 1; k < 4; ++k)
    if (glm::length(arms[0] + arms[k]) < kFlat * flat.extent) opposite = k;
  if (opposite == 0) return std::nullopt;
  const size_t next = opposite == 1 ? 2 : 1, last = 6 - opposite - next;
  if (glm::length(arms[next] + arms[last]) > kFlat * flat.extent) return std::nullopt;
  glm::dvec3 u = 0.5 * (arms[next] - arms[0]), v = 0.5 * (arms[next] + arms[0]);
  if (std::abs(4 * glm::length(glm::cross(u, v)) - flat.area) > 10 * kFlat * flat.area) return std::nullopt;
  if (glm::dot(glm::cross(u, v), flat.normal) < 0) std::swap(u, v);
  return RectangleLight{flat.centre, u, v, radiance};
}

/// A regular polygon, or one with a regular hole, as the round shape of the same area.
std::optional<LightShape> RoundOf(const FlatMesh& flat, const glm::dvec3& radiance) {
  double outer = 0, inner = 1e300;
  for (const glm::dvec3& corner : flat.corners) {
    outer = std::max(outer, glm::distance(corner, flat.centre));
    inner = std::min(inner, glm::distance(corner, flat.centre));
  }
  struct Rim {
    double sum = 0;
    size_t count = 0;
    double Radius() const { return sum / static_cast<double>(count); }
    double Factor() const {
      return std::sin(2 * std::numbers::pi / static_cast<double>(count)) * static_cast<double>(count) / 2;
    }
    double Area() const { return Radius() * Radius() * Factor(); }
  } rim, hole;
  for (const glm::dvec3& corner : flat.corners) {
    const double r = glm::distance(corner, flat.centre);
    if (r > (1 - 10 * kFlat) * outer) rim.sum += r, ++rim.count;
    if (r < (1 + 10 * kFlat) * inner) hole.sum += r, ++hole.count;
  }
  if (rim.count < kLeastCorners) return std::nullopt;
  const auto round = [](double area) { return std::sqrt(area / std::numbers::pi); };
  const auto equals = [&](double area) { return std::abs(area - flat.area) < 10 * kFlat * flat.area; };
  if (equals(rim.Area())) return DiskLight{flat.centre, flat.normal, radiance, 0.0, round(rim.Area())};
  if (hole.count < kLeastCorners || hole.count + rim.count != flat.corners.size() || !equals(rim.Area() - hole.Area()))
    return std::nullopt;
  return DiskLight{flat.centre, flat.normal, radiance, round(hole.Area()), round(rim.Area())};
}

/// A disk that faces the origin from very far is a lamp at infinity.
LightShape FromFar(const LightShape& shape) {
  const auto* disk = std::get_if<DiskLight>(&shape);
  const double distance = disk ? glm::length(disk->centre_mm) : 0.0;
  if (!disk || disk->inner_radius_mm > 0 || distance < kInfinitelyFar_mm) return shape;
  const glm::dvec3 direction = disk->centre_mm / distance;
  if (glm::dot(direction, disk->normal) > -0.9999) return shape;
  const double radius = std::atan(disk->outer_radius_mm / distance), sine = std::sin(radius);
  return DirectionalLight{direction, std::numbers::pi * sine * sine * disk->radiance, radius};
}

DiskLight DiskOf(const MitsubaPlugin& shape, const MitsubaUnit& unit, const glm::dvec3& radiance) {
  const glm::dmat4 to_world = shape.ToWorld();
  const glm::dvec3 u(to_world[0]), v(to_world[1]);
  const double radius = glm::length(u);
  if (!(radius > 0) || std::abs(glm::length(v) / radius - 1) > kFlat ||
      std::abs(glm::dot(u, v)) > kFlat * radius * radius)
    shape.node().Fail("its to_world makes an ellipse of the disk", "Scale x and y alike.");
  glm::dvec3 normal = glm::normalize(glm::cross(u, v));  // Mitsuba's is that of axis z, also of a mirrored disk
  if (glm::dot(normal, glm::dvec3(to_world[2])) < 0) normal = -normal;
  if (shape.Flag("flip_normals", false)) normal = -normal;
  return {unit.mm * glm::dvec3(to_world[3]), normal, radiance, 0.0, unit.mm * radius};
}

PointLight BallOf(const MitsubaPlugin& shape, const MitsubaUnit& unit, const glm::dvec3& radiance) {
  const glm::dmat4 to_world = shape.ToWorld();
  const auto rotation = glm::dmat3(to_world);
  const double scale = glm::length(rotation[0]);
  if (!(scale > 0) || std::abs(glm::length(rotation[1]) / scale - 1) > kFlat ||
      std::abs(glm::length(rotation[2]) / scale - 1) > kFlat)
    shape.node().Fail("its to_world makes an ellipsoid of the sphere", "Scale x, y and z alike.");
  if (shape.Flag("flip_normals", false)) shape.node().Fail("shines to its inside", "Remove flip_normals.");
  const double radius = unit.mm * scale * shape.Number("radius", 1e-12, 1e12).value_or(1.0);
  const glm::dvec3 centre = shape.Vector("center").value_or(glm::dvec3(0.0));
  return {unit.mm * glm::dvec3(to_world * glm::dvec4(centre, 1.0)), std::numbers::pi * radius * radius * radiance,
          radius};
}

LightShape LampShapeOf(const MitsubaPlugin& shape, const MitsubaUnit& unit, const glm::dvec3& radiance) {
  const std::string& type = shape.node().type;
  if (type == "sphere") return BallOf(shape, unit, radiance);
  if (type == "disk") return FromFar(DiskOf(shape, unit, radiance));
  ImportedMesh mesh = ReadMitsubaMesh(shape, unit);
  const bool is_rectangle = type == "rectangle";
  if (!is_rectangle && glm::determinant(glm::dmat3(shape.ToWorld())) < 0)
    shape.node().Fail("a lamp with a mirrored to_world can't be read", "Mirror the mesh in its file.");
  if (shape.Flag("flip_normals", false))
    for (glm::ivec3& t : mesh.mesh.triangles) std::swap(t.y, t.z);
  if (const auto flat = FlatOf(mesh.mesh)) {
    if (const auto rectangle = RectangleOf(*flat, radiance)) return *rectangle;
    if (const auto round = RoundOf(*flat, radiance)) return FromFar(*round);
  }
  shape.node().Fail("a lamp of this shape has no equivalent in a light rig",
                    "Use a rectangle, a disk, a ring or a sphere; a round mesh needs 64 corners or more.");
}

glm::dvec3 PlaceOf(const LightShape& shape) {
  if (const auto* point = std::get_if<PointLight>(&shape)) return point->position_mm;
  if (const auto* disk = std::get_if<DiskLight>(&shape)) return disk->centre_mm;
  if (const auto* rectangle = std::get_if<RectangleLight>(&shape)) return rectangle->centre_mm;
  return glm::dvec3(0.0);
}

}  // namespace

ImportedLight ReadMitsubaEmitter(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit,
                                 std::vector<EvenCone>& cones) {
  const auto with = [&](const std::vector<std::string>& known) { return MitsubaPlugin(document, node, known); };
  if (node.type == "point") return ReadPoint(with({"position", "to_world", "intensity", "sampling_weight"}), unit);
  if (node.type == "spot")
    return ReadSpot(with({"to_world", "intensity", "cutoff_angle", "beam_width", "sampling_weight"}), unit, cones);
  if (node.type == "directional")
    return ReadDirectional(with({"direction", "to_world", "irradiance", "sampling_weight"}));
  if (node.type == "envmap")
    return ReadEnvironment(with({"filename", "to_world", "scale", "mis_compensation", "sampling_weight"}));
  if (node.type == "constant") {
    const MitsubaPlugin dome = with({"radiance", "sampling_weight"});
    return Named(dome, DomeLight{Needed(dome, "radiance")});
  }
  node.Fail("an emitter of this kind has no equivalent in a light rig",
            "Known: point, directional, spot, constant, envmap, and area on a shape.");
}

ImportedLight ReadMitsubaLamp(const MitsubaPlugin& shape, const MitsubaNode& emitter, const MitsubaUnit& unit) {
  if (emitter.type != "area")
    emitter.Fail("an emitter of this kind on a shape has no equivalent in a light rig", "Use an area emitter.");
  const MitsubaPlugin area(shape.document(), emitter, {"radiance", "sampling_weight"});
  const ImportedLight light = Named(shape, LampShapeOf(shape, unit, Needed(area, "radiance")));
  Place(shape, PlaceOf(light.light.shape));
  return light;
}

}  // namespace crownfit
