#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include "base/error.h"
#include "base/files.h"
#include "capture/camera.h"
#include "geometry/mesh_file.h"
#include "geometry/signed_distance.h"
#include "scene/crown.h"
#include "scene/crown_source.h"
#include "support/known_scene.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

std::string StlText(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(9);
  out << "solid s\n";
  for (const auto& t : mesh.triangles) {
    out << "facet normal 0 0 0\nouter loop\n";
    for (int k = 0; k < 3; ++k)
      out << "vertex " << mesh.vertices[t[k]].x << " " << mesh.vertices[t[k]].y << " " << mesh.vertices[t[k]].z << "\n";
    out << "endloop\nendfacet\n";
  }
  return out.str() + "endsolid s\n";
}

std::string ObjText(const TriangleMesh& mesh) {
  std::ostringstream out;
  out.precision(9);
  for (const auto& v : mesh.vertices) out << "v " << v.x << " " << v.y << " " << v.z << "\n";
  for (const auto& t : mesh.triangles) out << "f " << t.x + 1 << "/1/1 " << t.y + 1 << "//2 " << t.z + 1 << "\n";
  return out.str();
}

TEST(MeshFiles, PlyStlAndObjGiveTheSameClosedSurface) {
  const TemporaryFolder folder;
  const TriangleMesh sphere = Sphere(4.0, 16);
  WritePly(folder.path / "s.ply", sphere);
  WriteTextFile(folder.path / "s.stl", StlText(sphere));
  WriteTextFile(folder.path / "s.obj", ObjText(sphere));
  for (const char* name : {"s.ply", "s.stl", "s.obj"}) {
    std::vector<std::string> messages;
    const TriangleMesh read = ReadClosedSurface(folder.path / name, messages);
    EXPECT_EQ(read.vertices.size(), sphere.vertices.size()) << name;
    EXPECT_NEAR(Volume(read), Volume(sphere), 1e-4 * Volume(sphere)) << name;
  }
}

TEST(MeshFiles, VertexPropertiesSurvive) {
  const TemporaryFolder folder;
  TriangleMesh box = Box({-2, -2, -2}, {2, 2, 2});
  for (size_t i = 0; i < box.vertices.size(); ++i)
    box.vertex_properties["thickness_mm"].push_back(0.1 * static_cast<double>(i));
  WritePly(folder.path / "b.ply", box);
  EXPECT_EQ(ReadMeshFile(folder.path / "b.ply").vertex_properties.at("thickness_mm"),
            box.vertex_properties["thickness_mm"]);
}

TEST(MeshFiles, TruncatedNotFiniteEmptyAndOutOfRangeAreRefused) {
  const TemporaryFolder folder;
  const TriangleMesh sphere = Sphere(4.0, 8);
  WritePly(folder.path / "t.ply", sphere);
  std::filesystem::resize_file(folder.path / "t.ply", std::filesystem::file_size(folder.path / "t.ply") - 5);
  EXPECT_THROW(ReadMeshFile(folder.path / "t.ply"), InputError);
  const std::string stl = StlText(sphere);
  WriteTextFile(folder.path / "t.stl", stl.substr(0, stl.size() / 2));
  EXPECT_THROW(ReadMeshFile(folder.path / "t.stl"), InputError);
  TriangleMesh broken = sphere;
  broken.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  WritePly(folder.path / "nan.ply", broken);
  EXPECT_THROW(ReadMeshFile(folder.path / "nan.ply"), InputError);
  broken = sphere;
  broken.triangles.clear();
  WritePly(folder.path / "none.ply", broken);
  EXPECT_THROW(ReadMeshFile(folder.path / "none.ply"), InputError);
  broken = sphere;
  broken.triangles[0].x = 9999;
  WritePly(folder.path / "index.ply", broken);
  EXPECT_THROW(ReadMeshFile(folder.path / "index.ply"), InputError);
}

TEST(MeshRepair, InvertedAndMixedFacesAreReorientedWithAMessage) {
  const TemporaryFolder folder;
  const TriangleMesh sphere = Sphere(4.0, 12);
  TriangleMesh turned = sphere;
  for (auto& t : turned.triangles) std::swap(t.x, t.y);
  TriangleMesh mixed = sphere;
  for (size_t i = 0; i < mixed.triangles.size(); i += 3) std::swap(mixed.triangles[i].x, mixed.triangles[i].y);
  for (const TriangleMesh& wrong : {turned, mixed}) {
    WritePly(folder.path / "w.ply", wrong);
    std::vector<std::string> messages;
    EXPECT_NEAR(Volume(ReadClosedSurface(folder.path / "w.ply", messages)), Volume(sphere), 1e-3);
    EXPECT_FALSE(messages.empty());
  }
}

/// The mesh as read back from a file.
TriangleMesh Reread(const TriangleMesh& mesh, std::vector<std::string>& messages) {
  const TemporaryFolder folder;
  WritePly(folder.path / "m.ply", mesh);
  return ReadClosedSurface(folder.path / "m.ply", messages);
}

TEST(MeshRepair, DuplicateFacesCountOnce) {
  const TriangleMesh sphere = Sphere(4.0, 12);
  const int vertices = static_cast<int>(sphere.vertices.size());
  for (const bool own_vertices : {false, true}) {
    for (const bool other_side : {false, true}) {
      TriangleMesh doubled = sphere;
      if (own_vertices) doubled.vertices.insert(doubled.vertices.end(), sphere.vertices.begin(), sphere.vertices.end());
      for (glm::ivec3 t : sphere.triangles) {
        if (other_side) std::swap(t.x, t.y);
        doubled.triangles.push_back(own_vertices ? t + vertices : t);
      }
      std::vector<std::string> messages;
      const TriangleMesh read = Reread(doubled, messages);
      EXPECT_EQ(read.triangles.size(), sphere.triangles.size());
      EXPECT_EQ(read.vertices.size(), sphere.vertices.size());
      EXPECT_NEAR(Volume(read), Volume(sphere), 1e-3);
      EXPECT_EQ(messages.size(), 1u) << messages[0];
    }
  }
}

double CutArea(const TriangleMesh& mesh) {
  TriangleMesh cut = mesh;
  cut.triangles.clear();
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    if (mesh.cut(static_cast<int>(t))) cut.triangles.push_back(mesh.triangles[t]);
  return Area(cut);
}

TEST(MeshRepair, HolesAreFilledAndTheScanNeckBecomesACut) {
  TriangleMesh sphere = Sphere(4.0, 48);
  std::vector<std::string> messages;
  TriangleMesh holed = sphere;
  holed.triangles.erase(holed.triangles.begin() + 3000);
  holed.triangles.erase(holed.triangles.begin() + 1000);
  const TriangleMesh filled = Reread(holed, messages);
  EXPECT_NEAR(Volume(filled), Volume(sphere), 1e-3);
  EXPECT_EQ(CutArea(filled), 0.0);
  ASSERT_EQ(messages.size(), 1u);
  EXPECT_NE(messages[0].find("2 holes"), std::string::npos) << messages[0];

  // Open below z = -2: a spherical segment and a flat cut of radius sqrt(12).
  messages.clear();
  const TriangleMesh closed = Reread(OpenBelow(sphere, -2.0), messages);
  EXPECT_NEAR(Volume(closed), kPi * 36.0 / 3.0 * (3 * 4.0 - 6.0), 0.01 * 226);
  EXPECT_NEAR(CutArea(closed), kPi * 12.0, 0.03 * 38);
  for (size_t t = 0; t < closed.triangles.size(); ++t)
    if (closed.cut(static_cast<int>(t))) {
      ASSERT_LT(FaceNormal(closed, static_cast<int>(t)).z, -0.999);
    }
  EXPECT_NE(messages.back().find("neck"), std::string::npos);  // after the loose vertices
  const TriangleMesh fine = Refined(closed, 0.3);
  EXPECT_NEAR(CutArea(fine), CutArea(closed), 1e-9);

  EXPECT_THROW(Reread(OpenBelow(sphere, 2.0), messages), InputError);  // more opening than surface
}

TEST(Offsets, LayersContinueBelowTheCutOfAnOpenScan) {
  std::vector<std::string> messages;
  const TriangleMesh scan = Reread(OpenBelow(Sphere(4.0, 64), -2.0), messages);
  const auto inner = DepthField(scan, 0).LevelSurface(0.7);
  ASSERT_TRUE(inner);
  const auto [low, high] = Bounds(*inner);
  EXPECT_NEAR(low.z, -1.95, 0.02);  // a hair above the cut
  EXPECT_NEAR(high.z, 3.3, 0.01);
  // The segment of a sphere of radius 3.3 above z = -1.95.
  const double h = 3.3 + 1.95;
  EXPECT_NEAR(Volume(*inner), kPi * h * h / 3.0 * (3 * 3.3 - h), 0.02 * 134);
}

TEST(Meshes, RefiningKeepsAreaVolumeAndClosure) {
  const TriangleMesh disc = Disc(1.0, 5.0, 32), fine = Refined(disc, 0.3);
  EXPECT_NEAR(Area(fine), Area(disc), 1e-9 * Area(disc));
  EXPECT_NEAR(Volume(fine), Volume(disc), 1e-9 * Volume(disc));
  for (const auto& t : fine.triangles)
    for (int k = 0; k < 3; ++k) ASSERT_LE(glm::distance(fine.vertices[t[k]], fine.vertices[t[(k + 1) % 3]]), 0.3);
  // Euler: a closed surface without holes has V - F/2 = 2.
  EXPECT_EQ(2 * fine.vertices.size() - fine.triangles.size(), 4u);
}

/// Two layers; the inner one follows the outer by a field.
KnownScene FieldScene(const TriangleMesh& mesh, const ThicknessField& field) {
  KnownScene scene(mesh, 2);
  scene.capture.layers[0].thickness_field = field;
  scene.capture.long_axis = glm::dvec3(0, 0, 1);
  scene.source.thickness[0] =
      std::make_shared<ThicknessMap>(scene.capture, 0, &*scene.source.meshes[0], *scene.source.meshes[0]);
  return scene;
}

TEST(ThicknessFields, ZoneThicknessesHoldAtTheMiddleOfEachThird) {
  const KnownScene scene = FieldScene(Box({-3, -3, -6}, {3, 3, 6}), {{0.3, 0.6, 0.9}, ""});
  for (const double scale : {1.0, 1.3}) {
    const TriangleMesh inner = BuildSurfaces(scene.capture, scene.source, {scale, 0.0})[1];
    int met = 0;
    for (const auto& v : inner.vertices)
      for (int zone = 0; zone < 3; ++zone)
        if (std::abs(v.z - 4.0 * (zone - 1)) < 0.05 && std::abs(v.y) < 1.5 && v.x > 0) {
          ASSERT_NEAR(3.0 - v.x, scale * (0.3 + 0.3 * zone), 0.01) << v.z;
          ++met;
        }
    EXPECT_GT(met, 30);
  }
}

TEST(Thickness, PlateThicknessIsIndependentOfItsRim) {
  const KnownScene scene(Disc(2.0, 5.0));
  EXPECT_NEAR(scene.Build()->thickness_mm[0], 2.0, 1e-6);
}

TEST(Thickness, InnerMeshEnclosingTheOuterIsRefused) {
  KnownScene scene(Sphere(1.0, 16), 2);
  scene.source.meshes[1] = Sphere(1.2, 16);
  EXPECT_THROW(scene.Build(), InputError);
  scene.source.meshes[1] = Sphere(0.8, 16);
  EXPECT_NEAR(scene.Build()->thickness_mm[0], 0.2, 0.01);
}

TEST(ThicknessFields, VertexValuesAreFollowedAndTheMeanIsReported) {
  TriangleMesh sphere = Sphere(4.0, 48);
  for (const auto& v : sphere.vertices) sphere.vertex_properties["t"].push_back(0.8 + 0.1 * v.z);
  const KnownScene scene = FieldScene(sphere, {{}, "t"});
  const auto crown = scene.Build();
  for (const auto& v : crown->surfaces[1].vertices) {
    const double r = glm::length(v);
    ASSERT_NEAR(4.0 - r, 0.8 + 0.1 * 4.0 * v.z / r, 0.02);
  }
  EXPECT_NEAR(crown->thickness_mm[0], 0.8, 0.02);
  EXPECT_THROW(FieldScene(sphere, {{}, "absent"}), InputError);
}

TEST(ThicknessFields, JunctionNoiseHasItsAmplitudeAndIsReproducible) {
  const TriangleMesh sphere = Sphere(4.0, 48);
  KnownScene scene(sphere, 2, 0.8);
  const auto rms = [&](double amplitude, uint64_t seed) {
    scene.capture.layers[0].junction_noise = {amplitude, 1.0, seed};
    scene.source.thickness[0] = std::make_shared<ThicknessMap>(scene.capture, 0, &sphere, sphere);
    double sum = 0, count = 0;
    const TriangleMesh inner = BuildSurfaces(scene.capture, scene.source, {0.8, 0.0})[1];
    for (const auto& v : inner.vertices) sum += std::pow(4.0 - glm::length(v) - 0.8, 2), ++count;
    return std::sqrt(sum / count);
  };
  EXPECT_LT(rms(0.0, 1), 0.01);
  EXPECT_NEAR(rms(0.05, 1), 0.05, 0.01);
  EXPECT_EQ(rms(0.05, 1), rms(0.05, 1));
  EXPECT_NE(rms(0.05, 1), rms(0.05, 2));
}

TEST(Crowns, FlatLayersMatchPlateThicknessAndSphereMeanChord) {
  const auto plate = KnownScene(Disc(1.0, 12.0), 2, 0.3).Build();
  for (size_t v = 0; v < plate->columns.size(); ++v) {
    if (glm::length(glm::dvec2(plate->fine.vertices[v])) > 3) continue;
    ASSERT_NEAR(plate->columns[v].total_mm, 1.0, 0.01);
    ASSERT_NEAR(plate->columns[v].front.total_mm(), 0.3, 0.02);
    ASSERT_NEAR(plate->columns[v].back.total_mm(), 0.3, 0.02);
  }
  // 2 V / S is 2/3 of the radius. Counting oblique chords as straight adds a little.
  const auto sphere = KnownScene(Sphere(4.0, 48)).Build();
  for (const Column& c : sphere->columns) ASSERT_NEAR(c.total_mm, 4.0 * 0.70, 0.05);
}

TEST(Taps, ClosedObjectHasATargetForEveryTapOnBothSides) {
  const auto crown = KnownScene(Incisor()).Build();
  const size_t expected = crown->kernel.offsets.size() * crown->fine.vertices.size();
  size_t opposite = 0;
  for (const Tap& tap : crown->taps) opposite += tap.opposite.exists();
  EXPECT_GT(static_cast<double>(crown->taps.size()), 0.999 * static_cast<double>(expected));
  EXPECT_GT(static_cast<double>(opposite), 0.999 * static_cast<double>(expected));
}

TEST(Crowns, ProtrudingRootIsTheOuterSurface) {
  std::vector<std::string> messages;
  KnownScene scene(Reread(OpenBelow(Sphere(2.0, 48), -0.5), messages), 2);
  TriangleMesh root = Sphere(1.5, 48);
  for (auto& v : root.vertices) v.z -= 1.0;
  scene.source.meshes[1] = root;
  const auto crown = scene.Build();
  int on_root = 0, on_enamel = 0;
  for (size_t v = 0; v < crown->fine.vertices.size(); ++v) {
    const glm::dvec3& p = crown->fine.vertices[v];
    const Column& c = crown->columns[v];
    if (p.z < -0.8) {
      ++on_root;
      ASSERT_NEAR(glm::length(p - glm::dvec3(0, 0, -1)), 1.5, 0.01);
      ASSERT_EQ(c.front.total_mm(), 0.0);
    } else if (p.z > 1.95) {
      ++on_enamel;
      ASSERT_NEAR(c.straight.front.total_mm(), 1.5, 0.05);  // down to the root's top at z = 0.5
      ASSERT_LT(c.front.total_mm(), 1.5);
    }
  }
  EXPECT_GT(on_root, 100);
  EXPECT_GT(on_enamel, 5);
}

TEST(Meshes, NormalsAreSmoothOnACurveAndSharpAtARim) {
  const TriangleMesh sphere = Sphere(4.0, 32), disc = Disc(1.0, 5.0, 64);
  const auto smooth = CornerNormals(sphere);
  for (size_t t = 0; t < smooth.size(); ++t)
    for (int k = 0; k < 3; ++k)
      ASSERT_GT(glm::dot(smooth[t][k], glm::normalize(sphere.vertices[sphere.triangles[t][k]])), 0.999);
  const auto sharp = CornerNormals(disc);
  for (size_t t = 0; t < sharp.size(); ++t) {
    if (FaceNormal(disc, static_cast<int>(t)).z < 0.99) continue;
    for (int k = 0; k < 3; ++k) ASSERT_GT(sharp[t][k].z, 0.9999);
  }
}

TEST(Offsets, ASphereShrinksByTheThicknessEverywhere) {
  const TriangleMesh sphere = Sphere(4.0, 64);
  const DepthField field(sphere, 0);
  EXPECT_NEAR(field.max_depth_mm(), 4.0, 0.1);
  for (double t : {0.03, 0.4, 1.5, 3.0}) {
    const auto inner = field.LevelSurface(t);
    ASSERT_TRUE(inner);
    for (const auto& v : inner->vertices)
      ASSERT_NEAR(glm::length(v), 4.0 - t, 0.012);  // the mesh itself dents by 0.005
    const double r = 4.0 - t;
    EXPECT_NEAR(Volume(*inner), 4.0 / 3.0 * kPi * r * r * r, 0.03 * r * r * r + 0.02) << t;
  }
  EXPECT_FALSE(field.LevelSurface(4.5));
}

TEST(Offsets, InnerLayerEndsBelowTwiceTheThickness) {
  // A step: 3 mm thick on one side, 0.8 mm on the other. An offset by 0.5 mm exists in the thick part only.
  TriangleMesh step = Box({-4, -3, -3}, {0, 3, 0});
  const DepthField thick(step, 0);
  const auto inner = thick.LevelSurface(0.5);
  ASSERT_TRUE(inner);
  const auto [low, high] = Bounds(*inner);
  EXPECT_NEAR(high.z, -0.5, 1e-3);
  EXPECT_NEAR(low.x, -3.5, 1e-3);
  EXPECT_FALSE(DepthField(Box({-4, -3, -0.8}, {0, 3, 0}), 0).LevelSurface(0.5));
}

TEST(Rays, SphereDistancesMatchTheClosedForm) {
  const TriangleMesh sphere = Sphere(4.0, 96);
  const RayCaster caster({&sphere});
  const auto hit = caster.Nearest({0.3, 0.2, 10}, {0, 0, -1});
  ASSERT_TRUE(hit);
  EXPECT_NEAR(hit->distance_mm, 10 - std::sqrt(16 - 0.13), 3e-3);  // facets of a 4 mm sphere with 96 rings
  EXPECT_TRUE(caster.Occluded({0, 0, 10}, {0, 0, -1}, 0.0, 7.0));
  EXPECT_FALSE(caster.Occluded({0, 0, 10}, {0, 0, -1}, 0.0, 5.0));
  EXPECT_NEAR(caster.DistanceToSurface({0, 0, 1}), 3.0, 3e-3);
  EXPECT_TRUE(IsInside(caster, sphere, {0, 0, 3.9}));
  EXPECT_FALSE(IsInside(caster, sphere, {0, 0, 4.1}));
}

TEST(Cameras, PixelAndDirectionAreInverseUnderDistortion) {
  Camera camera{.width = 640, .height = 480, .fx = 800, .fy = 790, .cx = 322, .cy = 238};
  camera.distortion = {-0.12, 0.05, 1e-3, -8e-4, 0.01, 0, 0, 0};
  for (const glm::dvec2 pixel : {glm::dvec2(0.5, 0.5), {320, 240}, {630.2, 17.9}}) {
    const auto back = PixelFromPoint(camera, 250.0 * DirectionFromPixel(camera, pixel));
    ASSERT_TRUE(back);
    EXPECT_NEAR(back->x, pixel.x, 1e-9);
    EXPECT_NEAR(back->y, pixel.y, 1e-9);
  }
  EXPECT_FALSE(PixelFromPoint(camera, {0, 0, -1}));
}

TEST(Layers, DistantMeshesAreRefused) {
  const TemporaryFolder folder;
  KnownScene scene(Sphere(4.0, 12), 2, 0.5, 6, 8.0);
  for (size_t l = 0; l < 2; ++l) scene.capture.layers[l].surface = folder.path / (std::to_string(l) + ".ply");
  WritePly(*scene.capture.layers[0].surface, Sphere(4.0, 12));
  TriangleMesh core = Sphere(2.0, 12);
  const auto moved_to = [&](double x) {
    TriangleMesh there = core;
    for (glm::dvec3& v : there.vertices) v.x += x;
    WritePly(*scene.capture.layers[1].surface, there);
    return ReadCrownSource(scene.capture, 1);
  };
  EXPECT_NO_THROW(moved_to(0.0));
  EXPECT_NO_THROW(moved_to(6.5)) << "beside it, as in a cavity of a shell with a thin gap";
  EXPECT_THROW(moved_to(8.0), InputError) << "2 mm of air between them: two frames";
}

}  // namespace
}  // namespace crownfit
