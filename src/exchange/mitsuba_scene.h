#pragma once
// What scenes of Mitsuba 3 say, in crownfit's terms: millimetres, 1/mm, the scene's axes.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/light_rig.h"
#include "exchange/imported_views.h"
#include "exchange/mitsuba_plugin.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

/// A surface of the scene.
struct ImportedMesh {
  TriangleMesh mesh;
  std::filesystem::path unchanged;  ///< the file that holds just this mesh; empty: none does
};

struct ImportedLayer {
  std::string name;
  ImportedMesh surface;
  double ior = 1, asymmetry = 0, isotropic_fraction = 0;
  glm::dvec3 reduced_scattering_per_mm{0.0}, absorption_per_mm{0.0};
};

/// Opaque and Lambertian on both sides.
struct ImportedThing {
  std::string name;
  TriangleMesh mesh;
  glm::dvec3 reflectance{0.0};
};

struct ImportedLight {
  Light light;
  std::filesystem::path picture;  ///< of an environment
};

/// The boundary of the outermost layer, and what closes the object at its neck.
struct ImportedSurface {
  double outside_ior = 1, roughness = 0;
  std::optional<glm::dvec3> neck_reflectance;  ///< from inside; absent: the meshes are closed
};

struct ImportedScene {
  std::vector<ImportedView> views;  ///< in mm
  std::vector<ImportedLayer> layers;
  ImportedSurface surface;
  std::vector<ImportedLight> lights;
  std::vector<ImportedThing> things;
};

/// Reads a scene. Without a sensor it has no views. Throws InputError, with the element's name, for what a capture
/// can't hold.
ImportedScene ReadMitsuba(const std::filesystem::path& file, double mm_per_unit);

/// The unit of a scene's lengths.
struct MitsubaUnit {
  double mm = 1;
};
/// The mesh of a shape: ply, obj, rectangle or cube.
ImportedMesh ReadMitsubaMesh(const MitsubaPlugin& shape, const MitsubaUnit& unit);
/// What a shape may hold.
const std::vector<std::string>& KnownOfShapes();
/// A name for what the element stands for: its id, or else the stem of its file, without a prefix of the export.
/// Letters, digits, - and _ only.
std::string NameOfPart(const MitsubaPlugin& plugin, const std::string& prefix, const std::string& otherwise);

/// A spot whose light is even over a cone, which the object has to lie in.
struct EvenCone {
  const MitsubaNode* node;
  glm::dvec3 position_mm, axis;
  double cosine;
};
ImportedLight ReadMitsubaEmitter(const MitsubaDocument& document, const MitsubaNode& node, const MitsubaUnit& unit,
                                 std::vector<EvenCone>& cones);
/// An area emitter on a shape.
ImportedLight ReadMitsubaLamp(const MitsubaPlugin& shape, const MitsubaNode& emitter, const MitsubaUnit& unit);

}  // namespace crownfit
