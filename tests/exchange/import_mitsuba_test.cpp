// Scenes of Mitsuba 3: cameras and lamps are where Mitsuba 3.9.1 itself has them, an exported capture comes back as it
// was, and what a capture can't hold is refused by its name.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>

#include "base/error.h"
#include "capture/capture.h"
#include "exchange/exporters.h"
#include "exchange/import_capture.h"
#include "exchange/mitsuba_scene.h"
#include "geometry/mesh_file.h"
#include "optics/material.h"
#include "photo/image_io.h"
#include "scene/crown_input.h"
#include "support/channels.h"
#include "support/refusal.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
constexpr double kPi = std::numbers::pi;
constexpr double kSingle = 1e-6;  // of a length: meshes are written in single precision

Path Written(const TemporaryFolder& folder, const std::string& inside, const std::string& name = "view.xml") {
  std::ofstream(folder.path / name) << "<scene version=\"3.0.0\">\n" << inside << "</scene>\n";
  return folder.path / name;
}

std::string Film(const std::string& more = "") {
  return "<film type=\"hdrfilm\"><integer name=\"width\" value=\"640\"/><integer name=\"height\" value=\"480\"/>" +
         more + "</film>";
}
std::string Sensor(const std::string& more = "<float name=\"fov\" value=\"5\"/>", const std::string& film = Film()) {
  return "<sensor type=\"perspective\">" + more +
         "<transform name=\"to_world\"><lookat origin=\"30, -20, 250\" target=\"1, 2, 3\" up=\"0.1, 1, 0\"/>"
         "<rotate z=\"1\" angle=\"25\"/><translate x=\"5\" y=\"-3\"/></transform>" +
         film + "</sensor>";
}

/// Three places, and their pixels by `sensor.sample_direction` of Mitsuba 3.9.1 (scalar_rgb). The rays that
/// `sensor.sample_ray` sends through these pixels pass the places at less than 2e-5.
constexpr glm::dvec3 kPlaces[] = {{0, 0, 0}, {4, -3, 2}, {8, 7, 3}};
struct CameraCase {
  const char *name, *sensor, *film;
  glm::dvec2 pixels[3];
};
constexpr const char* kFov = "<float name=\"fov\" value=\"5\"/>";
const CameraCase kCameras[] = {
    {"x", "", "", {{200.9743, 178.7577}, {273.1846, 293.9644}, {475.618, 52.2734}}},
    {"y",
     "<string name=\"fov_axis\" value=\"y\"/>",
     "",
     {{230.7307, 194.0683}, {284.8884, 280.4733}, {436.7136, 99.2051}}},
    {"diagonal",
     "<string name=\"fov_axis\" value=\"diagonal\"/>",
     "",
     {{171.2179, 163.4471}, {261.4808, 307.4555}, {514.5226, 5.3418}}},
    {"smaller",
     "<string name=\"fov_axis\" value=\"smaller\"/>",
     "",
     {{230.7307, 194.0683}, {284.8884, 280.4733}, {436.7136, 99.2051}}},
    {"larger",
     "<string name=\"fov_axis\" value=\"larger\"/>",
     "",
     {{200.9743, 178.7577}, {273.1846, 293.9644}, {475.618, 52.2734}}},
    {"offset",
     "<float name=\"principal_point_offset_x\" value=\"0.1\"/>"
     "<float name=\"principal_point_offset_y\" value=\"-0.05\"/>",
     "",
     {{136.9743, 202.7577}, {209.1846, 317.9644}, {411.618, 76.2734}}},
    {"crop",
     "<float name=\"principal_point_offset_x\" value=\"0.1\"/>",
     "<integer name=\"crop_width\" value=\"500\"/><integer name=\"crop_height\" value=\"400\"/>"
     "<integer name=\"crop_offset_x\" value=\"60\"/><integer name=\"crop_offset_y\" value=\"40\"/>",
     {{76.9743, 138.7577}, {149.1846, 253.9644}, {351.618, 12.2734}}},
};

void ExpectPixels(const ImportedView& view, const CameraCase& expected) {
  for (size_t k = 0; k < std::size(kPlaces); ++k) {
    const auto pixel = PixelFromPoint(view.camera, view.camera_from_world.Point(kPlaces[k]));
    ASSERT_TRUE(pixel) << expected.name;
    EXPECT_LT(glm::distance(*pixel, expected.pixels[k]), 1e-3) << expected.name << ", place " << k;
  }
}

TEST(Mitsuba, PlacesLandOnThePixelsOfMitsuba) {
  const TemporaryFolder folder;
  for (const CameraCase& c : kCameras) {
    const Path file = Written(folder, Sensor(std::string(kFov) + c.sensor, Film(c.film)));
    const auto views = ReadMitsuba(file, 1.0).views;
    ASSERT_EQ(views.size(), 1u);
    EXPECT_EQ(views[0].camera.width, std::string(c.name) == "crop" ? 500 : 640);
    ExpectPixels(views[0], c);
  }
  const CameraCase focal{"focal", "", "", {{199.8895, 178.1995}, {272.7579, 294.4563}, {477.0364, 50.5625}}};
  ExpectPixels(ReadMitsuba(Written(folder, Sensor("<string name=\"focal_length\" value=\"400mm\"/>")), 1.0).views[0],
               focal);
}

TEST(Mitsuba, UnitScalesPlacesAndKeepsPixels) {
  const TemporaryFolder folder;
  const ImportedView view = ReadMitsuba(Written(folder, Sensor()), 10.0).views[0];
  const auto pixel = PixelFromPoint(view.camera, view.camera_from_world.Point(10.0 * kPlaces[1]));
  ASSERT_TRUE(pixel);
  EXPECT_LT(glm::distance(*pixel, kCameras[0].pixels[1]), 1e-3);
}

TEST(Mitsuba, VariablesIncludesAndReferencesAreFollowed) {
  const TemporaryFolder folder;
  Written(folder,
          "<medium type=\"homogeneous\" id=\"inside\"><rgb name=\"sigma_t\" value=\"$dense\"/>"
          "<float name=\"scale\" value=\"3\"/><rgb name=\"albedo\" value=\"0.5 0.75 1\"/>"
          "<phase type=\"hg\"><float name=\"g\" value=\"0.5\"/></phase></medium>"
          "<bsdf type=\"roughdielectric\" id=\"skin\"><float name=\"int_ior\" value=\"1.6\"/>"
          "<string name=\"ext_ior\" value=\"water\"/><string name=\"distribution\" value=\"ggx\"/>"
          "<float name=\"alpha\" value=\"0.25\"/></bsdf>",
          "part.xml");
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  const Path file = Written(folder,
                            "<default name=\"dense\" value=\"2\"/><default name=\"denser\" value=\"crown\"/>"
                            "<include filename=\"part.xml\"/><alias id=\"skin\" as=\"leather\"/>" +
                                Sensor() +
                                "<shape type=\"ply\"><string name=\"filename\" value=\"$denser.ply\"/>"
                                "<ref id=\"leather\"/><ref name=\"interior\" id=\"inside\"/></shape>");
  const ImportedScene scene = ReadMitsuba(file, 2.0);
  ASSERT_EQ(scene.layers.size(), 1u);
  const ImportedLayer& layer = scene.layers[0];
  EXPECT_EQ(layer.name, "inside");
  EXPECT_EQ(layer.ior, 1.6);
  EXPECT_EQ(scene.surface.outside_ior, 1.333);
  EXPECT_EQ(scene.surface.roughness, 0.25);
  // sigma_t = 6 per unit of 2 mm: 3 / mm. Reduced by 1 - g.
  EXPECT_LT(glm::distance(layer.reduced_scattering_per_mm, glm::dvec3(0.75, 1.125, 1.5)), 1e-12);
  EXPECT_LT(glm::distance(layer.absorption_per_mm, glm::dvec3(1.5, 0.75, 0.0)), 1e-12);
  const auto [low, high] = Bounds(layer.surface.mesh);
  EXPECT_NEAR(high.z, 8.0, 8.0 * kSingle);
}

std::string Rgb(const std::string& name, const std::string& value) {
  return "<rgb name=\"" + name + "\" value=\"" + value + "\"/>";
}

template <class Shape>
Shape LampOf(const TemporaryFolder& folder, const std::string& lamp, double mm_per_unit = 1.0) {
  const ImportedScene scene = ReadMitsuba(Written(folder, Sensor() + lamp), mm_per_unit);
  EXPECT_EQ(scene.lights.size(), 1u);
  return std::get<Shape>(scene.lights.at(0).light.shape);
}

// Places, directions and strengths by `emitter.sample_direction` of Mitsuba 3.9.1. A pixel of crownfit is pi x
// radiance, and one of Mitsuba is the radiance.
TEST(Mitsuba, LampsStandAndShineAsInMitsuba) {
  const TemporaryFolder folder;
  const auto point = LampOf<PointLight>(
      folder,
      "<emitter type=\"point\"><transform name=\"to_world\"><scale value=\"2\"/><rotate y=\"1\" angle=\"90\"/>"
      "<translate x=\"1\" z=\"3\"/></transform>" +
          Rgb("intensity", "1,2,3") + "</emitter>");
  EXPECT_LT(glm::distance(point.position_mm, glm::dvec3(1, 0, 3)), 1e-12);
  EXPECT_LT(Distance(kPi * point.radiant_intensity, glm::dvec3(1, 2, 3)), 1e-12);
  const auto sun = LampOf<DirectionalLight>(
      folder, "<emitter type=\"directional\"><transform name=\"to_world\"><rotate x=\"1\" angle=\"90\"/></transform>" +
                  Rgb("irradiance", "2") + "</emitter>");
  EXPECT_LT(glm::distance(sun.direction, glm::dvec3(0, 1, 0)), 1e-12);
  EXPECT_LT(Distance(kPi * sun.irradiance, glm::dvec3(2.0)), 1e-12);
  const auto stated = LampOf<DirectionalLight>(
      folder, "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" z=\"-2\"/>" +
                  Rgb("irradiance", "2") + "</emitter>");
  EXPECT_LT(glm::distance(stated.direction, glm::dvec3(0, 0, 1)), 1e-12);
  EXPECT_LT(Distance(kPi * stated.irradiance, glm::dvec3(2.0)), 1e-12);
  // Irradiance falls with the square of lengths: in mm an intensity grows by the square of mm_per_unit.
  const auto scaled = LampOf<PointLight>(
      folder,
      "<emitter type=\"point\"><point name=\"position\" value=\"1,2,3\"/>" + Rgb("intensity", "1") + "</emitter>",
      10.0);
  EXPECT_LT(glm::distance(scaled.position_mm, glm::dvec3(10, 20, 30)), 1e-12);
  EXPECT_NEAR(kPi * scaled.radiant_intensity[0], 100.0, 1e-10);
}

/// Normals by `si.n` of Mitsuba 3.9.1: a mirrored rectangle turns over, a mirrored disk does not.
TEST(Mitsuba, AreaLampsShineToTheSideOfMitsuba) {
  const TemporaryFolder folder;
  const std::string area = "<emitter type=\"area\">" + Rgb("radiance", "3") + "</emitter></shape>";
  const auto normal_of = [&](const std::string& inside) {
    const auto lamp = LampOf<RectangleLight>(folder, "<shape type=\"rectangle\">" + inside + area);
    EXPECT_NEAR(kPi * lamp.radiance[0], 3.0, 1e-12);
    EXPECT_NEAR(glm::length(glm::cross(lamp.half_axis_u_mm, lamp.half_axis_v_mm)), 1.0, 1e-12);
    return glm::normalize(glm::cross(lamp.half_axis_u_mm, lamp.half_axis_v_mm)).z;
  };
  const std::string mirrored = "<transform name=\"to_world\"><scale x=\"-1\"/></transform>";
  EXPECT_NEAR(normal_of(""), 1.0, 1e-12);
  EXPECT_NEAR(normal_of(mirrored), -1.0, 1e-12);
  EXPECT_NEAR(normal_of("<boolean name=\"flip_normals\" value=\"true\"/>"), -1.0, 1e-12);
  EXPECT_NEAR(LampOf<DiskLight>(folder, "<shape type=\"disk\">" + mirrored + area).normal.z, 1.0, 1e-12);
  // A ball of radiance L and radius r has the intensity pi r^2 L.
  const auto ball = LampOf<PointLight>(
      folder,
      "<shape type=\"sphere\"><float name=\"radius\" value=\"0.5\"/><point name=\"center\" x=\"0\" y=\"0\" "
      "z=\"-1\"/><transform name=\"to_world\"><scale value=\"4\"/></transform>" +
          area);
  EXPECT_NEAR(ball.radius_mm, 2.0, 1e-12);
  EXPECT_NEAR(ball.position_mm.z, -4.0, 1e-12);
  EXPECT_NEAR(kPi * ball.radiant_intensity[0], kPi * 4.0 * 3.0, 1e-9);
}

std::string Object(const std::string& file = "crown.ply", const std::string& more = "") {
  return "<shape type=\"ply\"><string name=\"filename\" value=\"" + file +
         "\"/><bsdf type=\"dielectric\"/><medium type=\"homogeneous\" name=\"interior\">" + Rgb("sigma_t", "1") +
         Rgb("albedo", "0.5") + "</medium>" + more + "</shape>";
}

TEST(Mitsuba, SpotIsAPointWhereTheObjectLiesInItsEvenBeam) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(3.5, 12));  // from 10 away seen under asin 0.35 = 20.5 degrees
  const auto spot = [](const char* beam) {
    return std::string(
               "<emitter type=\"spot\"><transform name=\"to_world\"><lookat origin=\"0,0,10\" target=\"0,0,0\" "
               "up=\"0,1,0\"/></transform><float name=\"cutoff_angle\" value=\"30\"/><float name=\"beam_width\" "
               "value=\"") +
           beam + "\"/>" + Rgb("intensity", "5") + "</emitter>";
  };
  const ImportedScene scene = ReadMitsuba(Written(folder, Sensor() + Object() + spot("21")), 1.0);
  const auto& lamp = std::get<PointLight>(scene.lights.at(0).light.shape);
  EXPECT_LT(glm::distance(lamp.position_mm, glm::dvec3(0, 0, 10)), 1e-12);
  EXPECT_NEAR(kPi * lamp.radiant_intensity[0], 5.0, 1e-12);
  const Path narrow = Written(folder, Sensor() + Object() + spot("15"));
  EXPECT_NE(FaultOf([&] { ReadMitsuba(narrow, 1.0); }).find("beam_width"), std::string::npos);
}

/// Imports one scene with a photograph of its own.
Capture Imported(const TemporaryFolder& folder, const std::string& inside) {
  Written(folder, inside);
  WriteImageFile(folder.path / "view.exr", Image(640, 480, 3, 0.5f));
  ImportParts parts;
  parts.sources = {folder.path / "view.xml"};
  parts.photographs = folder.path;
  ImportCapture(parts, folder.path / "capture");
  return ReadCapture(folder.path / "capture");
}

TEST(Mitsuba, TurnedEnvironmentShinesFromWhereMitsubaSeesIt) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  constexpr int kWidth = 512, kHeight = 256;
  Image map(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double azimuth = 2 * kPi * (0.5 - (x + 0.5) / kWidth), polar = kPi * (y + 0.5) / kHeight;
      const glm::dvec3 way(std::sin(polar) * std::sin(azimuth), std::cos(polar), std::sin(polar) * std::cos(azimuth));
      for (int c = 0; c < 3; ++c) map.at(x, y, c) = static_cast<float>(1.5 + way[c]);
    }
  WriteImageFile(folder.path / "sky.exr", map);
  // By `environment.eval` of Mitsuba 3.9.1 along the first direction; two pixels are 0.025 rad.
  struct Case {
    glm::dvec3 way, plain, turned;
  };
  const Case cases[] = {{{0.18881712, -0.19839033, 0.96176368},
                         {0.1888318, -0.19800794, 0.96183753},
                         {-0.41177964, 0.4833219, 0.77254367}},
                        {{-0.89670228, -0.44166441, 0.02928439},
                         {-0.8970924, -0.44086194, 0.02929735},
                         {-0.8025554, 0.13402641, -0.5813127}}};
  for (const bool is_turned : {false, true}) {
    const std::string turn = is_turned ? "<transform name=\"to_world\"><rotate x=\"0.48\" y=\"0.6\" z=\"0.64\" "
                                         "angle=\"70\"/></transform>"
                                       : "";
    const Capture capture =
        Imported(folder, Sensor() + Object() +
                             "<emitter type=\"envmap\" id=\"sky\"><string name=\"filename\" value=\"sky.exr\"/>"
                             "<float name=\"scale\" value=\"2\"/>" +
                             turn + "</emitter>");
    const auto& sky = std::get<EnvironmentLight>(capture.lights.at(0).shape);
    for (const Case& c : cases)
      EXPECT_LT(Distance(kPi * sky.scale * sky.map->Radiance(c.way), 2.0 * ((is_turned ? c.turned : c.plain) + 1.5)),
                2 * 0.025);
  }
}

TEST(Mitsuba, SmoothBoundariesAndZerosStartWhereAFitMay) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  std::string object = Object();
  object.replace(object.find("0.5"), 3, "1, 1, 0");
  const Capture capture =
      Imported(folder, Sensor() + object + "<emitter type=\"constant\">" + Rgb("radiance", "1") + "</emitter>");
  const ParameterSpec& roughness = capture.surface[static_cast<size_t>(Quantity::kRoughness)];
  EXPECT_FALSE(roughness.fixed);
  EXPECT_EQ(roughness.value[0], RowOf(Quantity::kRoughness).low);
  EXPECT_EQ(capture.layers[0][Quantity::kAbsorption].value[0], RowOf(Quantity::kAbsorption).low);
  EXPECT_EQ(capture.layers[0][Quantity::kAbsorption].value[2], 1.0);
  EXPECT_EQ(capture.layers[0][Quantity::kReducedScattering].value[2], RowOf(Quantity::kReducedScattering).low);
  EXPECT_FALSE(std::filesystem::exists(folder.path / "capture/imported_parts"));
}

TEST(Mitsuba, WhatACaptureCannotHoldIsRefusedByName) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  const auto lamp = [](const std::string& shape) {
    return "<shape type=\"" + shape +
           "\"><emitter type=\"area\"><rgb name=\"radiance\" value=\"1\"/></emitter></shape>";
  };
  const auto thing = [](const std::string& bsdf) { return "<shape type=\"rectangle\">" + bsdf + "</shape>"; };
  std::string heterogeneous = Object(), two = Object(), rough = Object();
  heterogeneous.replace(heterogeneous.find("homogeneous"), 11, "heterogeneous");
  rough.replace(rough.find("<bsdf type=\"dielectric\"/>"), 25, "<bsdf type=\"roughdielectric\"/>");
  const std::pair<std::string, const char*> cases[] = {
      {"<sensor type=\"thinlens\"/>", "<sensor type=\"thinlens\">"},
      {"<sensor type=\"orthographic\"/>", "<sensor type=\"orthographic\">"},
      {Sensor("<animation name=\"to_world\"/>"), "is stated twice"},
      {"<sensor type=\"perspective\"><animation name=\"to_world\"/></sensor>", "<animation name=\"to_world\">"},
      {"<sensor type=\"perspective\"/>", "has no <film>"},
      {Sensor() + Object("crown.ply", "<float name=\"extra\" value=\"1\"/>"), "<float name=\"extra\">"},
      {heterogeneous, "<medium type=\"heterogeneous\""},
      {rough, "Beckmann"},
      {Object() + two, "lies in the same medium"},
      {Object("crown.ply", "<ref name=\"exterior\" id=\"none\"/>"), "no element has the id 'none'"},
      {Object("lost.ply"), "there is no file"},
      {thing("<bsdf type=\"conductor\"/>"), "<bsdf type=\"conductor\">"},
      {thing("<bsdf type=\"dielectric\"/>"), "clear body without a medium"},
      {thing("<bsdf type=\"diffuse\"><texture type=\"bitmap\" name=\"reflectance\"/></bsdf>"),
       "<texture type=\"bitmap\" name=\"reflectance\">"},
      {thing("<bsdf type=\"diffuse\"><spectrum name=\"reflectance\" value=\"400:0.1, 700:0.2\"/></bsdf>"),
       "spectrum over wavelengths"},
      {"<shape type=\"cylinder\"/>", "<shape type=\"cylinder\">"},
      {lamp("cube"), "no equivalent in a light rig"},
      {"<emitter type=\"sunsky\"/>", "<emitter type=\"sunsky\">"},
      {"<emitter type=\"spot\"><texture type=\"bitmap\" name=\"texture\"/></emitter>", "<texture type=\"bitmap\""},
      {"<emitter type=\"point\"/>", "has no intensity"},
      {"<shape type=\"rectangle\"><transform name=\"to_world\"><rotate x=\"1\" y=\"1\" "
       "angle=\"9\"/></transform></shape>",
       "Divide x, y and z by its length"},
      {"<shape type=\"$kind\"/>", "nothing defines '$kind'"},
      {"<include filename=\"view.xml\"/>", "without an end"},
      {"<film type=\"hdrfilm\"/>", "<film type=\"hdrfilm\">"},
  };
  for (const auto& [inside, expected] : cases) {
    const Path file = Written(folder, inside);
    const std::string fault = FaultOf([&] { ReadMitsuba(file, 1.0); });
    EXPECT_NE(fault.find(expected), std::string::npos) << inside << "\n" << fault;
    EXPECT_NE(fault.find("view.xml"), std::string::npos) << "names the file: " << fault;
  }
  std::ofstream(folder.path / "view.xml") << "<scene version=\"0.6.0\"/>";
  EXPECT_NE(FaultOf([&] { ReadMitsuba(folder.path / "view.xml", 1.0); }).find("Mitsuba 0.6"), std::string::npos);
  std::ofstream(folder.path / "view.xml") << "<scene version=\"3.0.0\">\n<shape>";
  EXPECT_NE(FaultOf([&] { ReadMitsuba(folder.path / "view.xml", 1.0); }).find("line 2"), std::string::npos);
}

TEST(Mitsuba, ScenesOfDifferentObjectsAreRefused) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  WritePly(folder.path / "other.ply", Sphere(4.1, 12));
  const std::string dome = "<emitter type=\"constant\">" + Rgb("radiance", "1") + "</emitter>";
  ImportParts parts;
  parts.sources = {Written(folder, Sensor() + Object() + dome, "a.xml"),
                   Written(folder, Sensor() + Object("other.ply") + dome, "b.xml")};
  parts.photographs = folder.path;
  EXPECT_NE(FaultOf([&] { ImportCapture(parts, folder.path / "capture"); }).find("another object"), std::string::npos);
}

TEST(Mitsuba, SensorsOfOneSceneAreFoundByTheirIds) {
  const TemporaryFolder folder;
  WritePly(folder.path / "crown.ply", Sphere(4.0, 12));
  for (const char* name : {"left.exr", "right.exr"}) WriteImageFile(folder.path / name, Image(640, 480, 3, 0.5f));
  std::string left = Sensor(), right = Sensor("<float name=\"fov\" value=\"6\"/>");
  left.insert(7, " id=\"left\""), right.insert(7, " id=\"right\"");
  ImportParts parts;
  parts.sources = {
      Written(folder, left + right + Object() + "<emitter type=\"constant\">" + Rgb("radiance", "1") + "</emitter>")};
  parts.photographs = folder.path;
  ImportCapture(parts, folder.path / "capture");
  const Capture capture = ReadCapture(folder.path / "capture");
  ASSERT_EQ(capture.photographs.size(), 2u);
  std::map<std::string, double> focal;
  for (const PhotographSpec& photo : capture.photographs) focal[photo.name] = photo.camera.fx;
  EXPECT_GT(focal.at("left"), focal.at("right"));
}

TEST(ScaleFromPoints, IsTheirDistanceInMillimetresOverThatInUnits) {
  EXPECT_DOUBLE_EQ(ScaleFromPoints("1,2,3:1,5,7=12.5"), 2.5);
  for (const char* wrong : {"", "1,2,3:1,2,3=5", "1,2,3:4,5,6", "1,2,3:4,5,6=-1", "1,2,3:4,5,6=7 mm"})
    EXPECT_NE(FaultOf([&] { ScaleFromPoints(wrong); }).find("--scale-from"), std::string::npos) << wrong;
}

}  // namespace
}  // namespace crownfit
