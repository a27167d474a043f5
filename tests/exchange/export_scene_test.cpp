// Inputs of the exporters: equivalents of layers, lamps as shapes, file names.

#include "exchange/export_scene.h"

#include <gtest/gtest.h>

#include <numbers>

#include "capture/capture.h"
#include "exchange/equivalents.h"
#include "optics/adding_doubling.h"
#include "scene/light_samples.h"
#include "support/channels.h"

namespace crownfit {
namespace {

ExportScene TwoLayers() {
  ExportScene scene;
  scene.channel_names = {"R", "G", "B"};
  scene.roughness = 0.2;
  scene.layers = {{"enamel", 1.63, 0.68, 0.0, glm::dvec3(6.25), {0.01, 0.02, 0.05}, 0.7},
                  {"dentine", 1.54, 0.93, 0.1, glm::dvec3(12, 14, 16), {0.03, 0.07, 0.2}, 2.0}};
  return scene;
}

ExportScene Scaled(ExportScene scene, double size) {
  for (ExportedLayer& layer : scene.layers) {
    layer.scattering_per_mm /= size;
    layer.absorption_per_mm /= size;
    layer.thickness_mm = size * *layer.thickness_mm;
  }
  return scene;
}

double LargestOff(const Spectrum& a, const Spectrum& b) {
  double off = 0;
  for (int c = 0; c < kChannels; ++c) off = std::max(off, std::abs(a[c] / b[c] - 1.0));
  return off;
}

TEST(Equivalents, SharesAreScaleInvariantAndPathsScaleWithLength) {
  const ExportScene scene = TwoLayers(), larger = Scaled(scene, 10.0);
  EXPECT_LT(LargestOff(TranslucencyOf(larger).reflectance, TranslucencyOf(scene).reflectance), 1e-9);
  EXPECT_LT(LargestOff(TranslucencyOf(larger).transmittance, TranslucencyOf(scene).transmittance), 1e-9);
  const ExportedLayer one = OneMediumFor(scene), ten = OneMediumFor(larger);
  EXPECT_LT(LargestOff(MultipleScatteringAlbedo(ten), MultipleScatteringAlbedo(one)), 1e-6);
  EXPECT_LT(LargestOff(MeanFreePath_mm(ten), 10.0 * MeanFreePath_mm(one)), 1e-6);
}

TEST(Equivalents, OneMediumMatchesTheLayeredReflectance) {
  ExportScene scene = TwoLayers();
  const Spectrum layers = TranslucencyOf(scene).reflectance;
  scene.layers = {OneMediumFor(scene)};
  EXPECT_LT(LargestOff(TranslucencyOf(scene).reflectance, layers), 1e-6);
  EXPECT_DOUBLE_EQ(*scene.layers[0].thickness_mm, 2.7);
}

TEST(Equivalents, OneMediumForOneLayerEqualsThatLayer) {
  ExportScene scene = TwoLayers();
  scene.layers.pop_back();
  const ExportedLayer one = OneMediumFor(scene);
  EXPECT_EQ(one.scattering_per_mm, scene.layers[0].scattering_per_mm);
  EXPECT_EQ(one.absorption_per_mm, scene.layers[0].absorption_per_mm);
}

TEST(Equivalents, MultipleScatteringAlbedoMatchesIndexMatchedHalfSpace) {
  // van de Hulst's formula is for isotropic scattering; the similarity relation extends it to others. docs/exchange.md
  // states 0.002.
  for (const double g : {0.0, 0.7, 0.93})
    for (const double albedo : {0.8, 0.9, 0.99, 0.999}) {
      Slab slab;
      slab.layers = {{1.0, g, 0.0, albedo / (1 - g), (1 - albedo), 1000.0}};
      ExportedLayer layer;
      layer.asymmetry = g;
      layer.scattering_per_mm = glm::dvec3(albedo / (1 - g));
      layer.absorption_per_mm = glm::dvec3(1 - albedo);
      EXPECT_NEAR(MultipleScatteringAlbedo(layer)[1], SolveByAddingDoubling(slab).value.reflectance_diffuse, 0.002)
          << "g " << g << ", reduced albedo " << albedo;
    }
}

/// Irradiance by the exported radiance on a surface at the origin with this normal.
double IrradianceOf(const ExportedLamp& lamp, const glm::dvec3& normal) {
  const auto& mesh = std::get<TriangleMesh>(lamp.shape);
  double sum = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const glm::ivec3& i = mesh.triangles[t];
    const glm::dvec3 a = mesh.vertices[i.x], b = mesh.vertices[i.y], c = mesh.vertices[i.z];
    const glm::dvec3 area = 0.5 * glm::cross(b - a, c - a), way = (a + b + c) / 3.0;
    const double d = glm::length(way);
    sum += std::max(0.0, -glm::dot(area, way / d)) * std::max(0.0, glm::dot(normal, way / d)) / (d * d);
  }
  return lamp.radiance[0] * sum;
}

TEST(ExportedLamps, FlatAndDistantLampsGiveTheirStatedIrradiance) {
  Capture capture;
  PhotographSpec photo;
  photo.exposure_scale = 2.0;
  const glm::dvec3 up(0, 0, 1);
  Light sun;
  sun.shape = DirectionalLight{up, glm::dvec3(3.0), 0.02};
  Light ring;
  ring.shape = DiskLight{{0, 0, 400}, -up, glm::dvec3(1.0), 5.0, 10.0};
  Light square;
  square.shape = RectangleLight{{0, 0, 400}, {0, 8, 0}, {8, 0, 0}, glm::dvec3(1.0)};  // shines along -z
  capture.lights = {sun, ring, square};
  photo.lights = {0, 1, 2};
  capture.photographs = {photo};
  ExportScene scene;
  AddPhotographs(capture, {}, scene);
  const auto& lamps = scene.photographs[0].lamps;
  const double pixel = 2.0 * std::numbers::pi;  // exposure x pi
  EXPECT_NEAR(IrradianceOf(lamps[0], up), pixel * 3.0, pixel * 3e-3);
  EXPECT_NEAR(IrradianceOf(lamps[1], up), pixel * std::numbers::pi * 75 / (400.0 * 400), pixel * 2e-6);
  EXPECT_NEAR(IrradianceOf(lamps[2], up), pixel * 256 / (400.0 * 400), pixel * 2e-6);
}

TEST(ExportedLamps, CameraMountedLampsMoveWithTheCamera) {
  Capture capture;
  Light lamp;
  lamp.in_camera_frame = true;
  lamp.shape = PointLight{{0, 0, 10}, glm::dvec3(1.0), 1.0};
  capture.lights = {lamp};
  PhotographSpec photo;
  photo.camera_from_object.translation_mm = {0, 0, 250};
  photo.lights = {0};
  capture.photographs = {photo};
  ExportScene scene;
  AddPhotographs(capture, {}, scene);
  EXPECT_EQ(std::get<BallLamp>(scene.photographs[0].lamps[0].shape).centre_mm, glm::dvec3(0, 0, -240));
}

TEST(LeaveOut, UnsupportedFeaturesAreRemovedAndReported) {
  Capture capture;
  LayerSpec layer;
  layer.name = "enamel";
  layer.absorption_texture.emplace();
  capture.layers = {layer};
  PhotographSpec photo;
  photo.name = "front";
  photo.polarisation = Polarisation::kCross;
  photo.camera = {100, 100, 1000, 1001, 50, 50, {0.1}};
  capture.photographs = {photo};
  Material material;
  material.surface[Quantity::kWetness].fill(0.5);
  std::vector<std::string> left_out;
  LeaveOutWhatOthersLack(capture, material, left_out);
  EXPECT_EQ(left_out.size(), 5u);  // texture, wetness, polarisers, distortion, pixels
  const size_t before = left_out.size();
  LeaveOutWhatOthersLack(capture, material, left_out);
  EXPECT_EQ(left_out.size(), before) << "the second call finds nothing to leave out";
  EXPECT_EQ(capture.photographs[0].camera.fx, capture.photographs[0].camera.fy);
}

TEST(FileNames, AreSafeAndUnique) {
  EXPECT_EQ(FileNames({"a/b", "a b", "ok-1"}), (std::vector<std::string>{"a_b", "a_b_", "ok-1"}));
  EXPECT_EQ(FileNames({"material", "a"}, "material"), (std::vector<std::string>{"material_", "a"}));
}

}  // namespace
}  // namespace crownfit
