// Scenes of Mitsuba 3 that crownfit exports and imports: the capture comes back as it was.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "capture/capture.h"
#include "exchange/exporters.h"
#include "exchange/import_capture.h"
#include "geometry/mesh_file.h"
#include "optics/material.h"
#include "scene/crown_input.h"
#include "support/channels.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
constexpr double kSingle = 1e-6;  // of a length: meshes are written in single precision
constexpr glm::dvec3 kPlaces[] = {{0, 0, 0}, {4, -3, 2}, {8, 7, 3}};

/// A capture of the sphere beside all kinds of lamps, and photographs for it.
struct ExportedSphere {
  explicit ExportedSphere(const Path& place) : folder(place) {
    const Path dataset = Path(CROWNFIT_DATASETS) / "sphere";
    capture = ReadCapture(dataset);
    material = ReadMaterialRecord(dataset / "truth.json", capture);
    material.material.layers[1][Quantity::kIsotropicFraction].fill(0.2);
    photographs = dataset / "photos";
    const auto add = [&](const char* name, const LightShape& shape) {
      Light light;
      light.name = name;
      light.shape = shape;
      capture.lights.push_back(light);
      capture.photographs[0].lights.push_back(capture.lights.size() - 1);
    };
    const glm::dvec3 slanted = glm::normalize(glm::dvec3(1, 2, 3));
    add("sun", DirectionalLight{slanted, {1.0, 1.1, 1.2}, 0.01});
    add("bulb", PointLight{{100, 20, -50}, {900, 1000, 1100}, 3.0});
    add("dish", DiskLight{{0, 150, 90}, -slanted, {2.0, 2.1, 2.2}, 0.0, 25.0});
    add("ring", DiskLight{{0, -150, 90}, slanted, {3.0, 3.1, 3.2}, 10.0, 25.0});
    capture.photographs[1].lights.push_back(capture.lights.size() - 1);  // the ring is on in two
    std::vector<std::string> left_out;
    LeaveOutWhatOthersLack(capture, material.material, left_out);
  }
  /// Exports the capture, imports it and reads the new one.
  Capture RoundTrip() {
    ExportScene scene = SceneOfMaterial(capture, material);
    std::vector<std::string> repairs;
    for (const LayerSpec& layer : capture.layers) scene.surfaces.push_back(ReadClosedSurface(*layer.surface, repairs));
    std::vector<TriangleMesh> scenery;
    for (const ScenerySpec& thing : capture.scenery) scenery.push_back(ReadMeshFile(thing.mesh));
    AddPhotographs(capture, scenery, scene);
    WriteMitsuba(scene, folder / "scenes");
    ImportParts parts;
    parts.sources = {folder / "scenes"};
    parts.photographs = photographs;
    EXPECT_TRUE(ImportCapture(parts, folder / "again").empty());
    return ReadCapture(folder / "again");
  }
  Path folder, photographs;
  Capture capture;
  MaterialRecord material;
};

const PhotographSpec& Named(const Capture& capture, const std::string& name) {
  const auto found = std::find_if(capture.photographs.begin(), capture.photographs.end(),
                                  [&](const PhotographSpec& photo) { return photo.name == name; });
  Check(found != capture.photographs.end(), "the photograph came back");
  return *found;
}

TEST(MitsubaRoundTrip, CamerasAndPosesComeBack) {
  const TemporaryFolder folder;
  ExportedSphere exported(folder.path);
  const Capture again = exported.RoundTrip();
  ASSERT_EQ(again.photographs.size(), exported.capture.photographs.size());
  for (const PhotographSpec& photo : exported.capture.photographs) {
    const PhotographSpec& other = Named(again, photo.name);
    EXPECT_EQ(other.camera.width, photo.camera.width);
    EXPECT_EQ(other.camera.height, photo.camera.height);
    EXPECT_NEAR(other.camera.fx, photo.camera.fx, 1e-6);
    EXPECT_NEAR(other.camera.fy, photo.camera.fy, 1e-6);
    EXPECT_NEAR(other.camera.cx, photo.camera.cx, 1e-6);
    EXPECT_NEAR(other.camera.cy, photo.camera.cy, 1e-6);
    for (const glm::dvec3& place : kPlaces)
      EXPECT_LT(glm::distance(other.camera_from_object.Point(place), photo.camera_from_object.Point(place)), 1e-9);
  }
}

TEST(MitsubaRoundTrip, MaterialAndMeshesComeBack) {
  const TemporaryFolder folder;
  ExportedSphere exported(folder.path);
  const Capture again = exported.RoundTrip();
  const Material stated = StatedMaterial(again);
  ASSERT_EQ(stated.layers.size(), exported.material.material.layers.size());
  EXPECT_EQ(again.outside_ior, exported.capture.outside_ior);
  EXPECT_NEAR(stated.surface[Quantity::kRoughness][0], exported.material.material.surface[Quantity::kRoughness][0],
              1e-12);
  for (size_t l = 0; l < stated.layers.size(); ++l) {
    const Material::Layer &layer = stated.layers[l], &truth = exported.material.material.layers[l];
    EXPECT_EQ(layer.name, truth.name);
    for (const Quantity q : {Quantity::kIor, Quantity::kAsymmetry, Quantity::kIsotropicFraction,
                             Quantity::kReducedScattering, Quantity::kAbsorption})
      for (int c = 0; c < kChannels; ++c)
        EXPECT_NEAR(layer[q][c], truth[q][c], 1e-12 * std::max(1.0, truth[q][c])) << RowOf(q).key;
    EXPECT_FALSE(again.layers[l][Quantity::kReducedScattering].fixed);
    EXPECT_FALSE(again.layers[l][Quantity::kAbsorption].fixed);
    const TriangleMesh mesh = ReadMeshFile(*again.layers[l].surface),
                       original = ReadMeshFile(*exported.capture.layers[l].surface);
    EXPECT_NEAR(Volume(mesh), Volume(original), 1e-5 * Volume(original));
  }
  EXPECT_FALSE(again.surface[static_cast<size_t>(Quantity::kRoughness)].fixed);
}

/// Irradiance of a lamp's whole front on a small area that faces it, and what else says where it is.
void ExpectSameLamp(const LightShape& lamp, const LightShape& original, double factor) {
  const auto near = [](const glm::dvec3& a, const glm::dvec3& b) {
    EXPECT_LT(glm::distance(a, b), 4 * kSingle * glm::length(b));
  };
  const auto as_bright = [](const Spectrum& a, const Spectrum& b) {
    EXPECT_LT(Distance(a, b), 4 * kSingle * std::sqrt(b.Dot(b)));
  };
  ASSERT_EQ(lamp.index(), original.index());
  if (const auto* sun = std::get_if<DirectionalLight>(&original)) {
    const auto& other = std::get<DirectionalLight>(lamp);
    near(other.direction, sun->direction);
    as_bright(other.irradiance, factor * sun->irradiance);
    EXPECT_NEAR(other.angular_radius, sun->angular_radius, 1e-4 * sun->angular_radius);
  } else if (const auto* point = std::get_if<PointLight>(&original)) {
    const auto& other = std::get<PointLight>(lamp);
    near(other.position_mm, point->position_mm);
    as_bright(other.radiant_intensity, factor * point->radiant_intensity);
    EXPECT_NEAR(other.radius_mm, point->radius_mm, kSingle * point->radius_mm);
  } else if (const auto* disk = std::get_if<DiskLight>(&original)) {
    const auto& other = std::get<DiskLight>(lamp);
    near(other.centre_mm, disk->centre_mm);
    near(other.normal, disk->normal);
    as_bright(other.radiance, factor * disk->radiance);
    EXPECT_NEAR(other.inner_radius_mm, disk->inner_radius_mm, 1e-5 * disk->outer_radius_mm);
    EXPECT_NEAR(other.outer_radius_mm, disk->outer_radius_mm, 1e-5 * disk->outer_radius_mm);
  } else if (const auto* rectangle = std::get_if<RectangleLight>(&original)) {
    const auto& other = std::get<RectangleLight>(lamp);
    near(other.centre_mm, rectangle->centre_mm);
    as_bright(other.radiance, factor * rectangle->radiance);
    near(glm::cross(other.half_axis_u_mm, other.half_axis_v_mm),
         glm::cross(rectangle->half_axis_u_mm, rectangle->half_axis_v_mm));
  } else {
    as_bright(std::get<DomeLight>(lamp).radiance, factor * std::get<DomeLight>(original).radiance);
  }
}

TEST(MitsubaRoundTrip, LampsComeBackByNameAndInTheirPhotographs) {
  const TemporaryFolder folder;
  ExportedSphere exported(folder.path);
  const Capture again = exported.RoundTrip();
  std::set<size_t> lit;
  for (const PhotographSpec& photo : exported.capture.photographs) lit.insert(photo.lights.begin(), photo.lights.end());
  EXPECT_EQ(again.lights.size(), lit.size()) << "a lamp of several photographs is one";
  for (const PhotographSpec& photo : exported.capture.photographs) {
    const PhotographSpec& other = Named(again, photo.name);
    ASSERT_EQ(other.lights.size(), photo.lights.size());
    for (size_t k = 0; k < photo.lights.size(); ++k) {
      const Light &lamp = again.lights[other.lights[k]], &original = exported.capture.lights[photo.lights[k]];
      EXPECT_EQ(lamp.name, original.name);
      ExpectSameLamp(lamp.shape, original.shape, photo.exposure_scale * original.intensity_scale);
    }
  }
}

TEST(MitsubaRoundTrip, SceneryComesBackInItsPhotographs) {
  const TemporaryFolder folder;
  ExportedSphere exported(folder.path);
  WritePly(folder.path / "blade.ply", SquareTile({0, -8, 0}, {0, 1, 0}, 20.0));
  exported.capture.scenery = {{"blade", folder.path / "blade.ply", {0.1, 0.2, 0.3}}};
  for (PhotographSpec& photo : exported.capture.photographs) photo.backing.reset();
  exported.capture.photographs[1].scenery = {0};
  const Capture again = exported.RoundTrip();
  ASSERT_EQ(again.scenery.size(), 1u);
  EXPECT_EQ(again.scenery[0].name, "blade");
  EXPECT_EQ(again.scenery[0].reflectance, glm::dvec3(0.1, 0.2, 0.3));
  for (const PhotographSpec& photo : exported.capture.photographs)
    EXPECT_EQ(Named(again, photo.name).scenery.size(), photo.scenery.size()) << photo.name;
}

TEST(MitsubaRoundTrip, OpenNeckComesBackWithItsReturn) {
  const TemporaryFolder folder;
  ExportedSphere exported(folder.path);
  WritePly(folder.path / "open.ply", OpenBelow(Sphere(4.0, 24), -2.0));
  exported.capture.layers.resize(1);
  exported.capture.layers[0].surface = folder.path / "open.ply";
  exported.material.material.layers.resize(1);
  ExportScene scene = SceneOfMaterial(exported.capture, exported.material);
  std::vector<std::string> repairs;
  scene.surfaces = {ReadClosedSurface(folder.path / "open.ply", repairs)};
  scene.neck_is_opaque = true;
  scene.neck_reflectance = 0.8 * HalfSpaceReflectance(exported.material.material.layers[0]);
  AddPhotographs(exported.capture, {}, scene);
  for (const double share : {0.8, 0.0}) {
    if (share == 0) scene.neck_reflectance = glm::dvec3(0.0);
    WriteMitsuba(scene, folder.path / "scenes");
    ImportParts parts;
    parts.sources = {folder.path / "scenes"};
    parts.photographs = exported.photographs;
    ImportCapture(parts, folder.path / "again");
    const Capture again = ReadCapture(folder.path / "again");
    EXPECT_EQ(again.neck, share > 0 ? Neck::kRoot : Neck::kAbsorbing);
    if (share > 0) {
      EXPECT_NEAR(again.surface[static_cast<size_t>(Quantity::kNeckReturn)].value[0], share, 1e-9);
    }
    const TriangleMesh mesh = ReadClosedSurface(*again.layers[0].surface, repairs);
    EXPECT_NEAR(Area(CutPart(mesh)), Area(CutPart(scene.surfaces[0])), 1e-5 * Area(mesh));
    EXPECT_NEAR(Volume(mesh), Volume(scene.surfaces[0]), 1e-5 * Volume(mesh));
  }
}

}  // namespace
}  // namespace crownfit
