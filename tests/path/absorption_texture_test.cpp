// Absorption that varies over a layer: looked up on the surface, integrated along paths, used by both models.

#include "scene/absorption_texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>

#include "base/error.h"
#include "geometry/mesh_file.h"
#include "path/path_photograph.h"
#include "photo/image_io.h"
#include "shader/predict.h"
#include "support/channels.h"
#include "support/known_scene.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// A box of 8 x 8 x 2 mm with a texture on its layer 0, from a file.
struct TexturedBox {
  TemporaryFolder folder;
  TriangleMesh mesh = Refined(Box({-4, -4, -2}, {4, 4, 0}), 0.5);
  KnownScene scene{mesh, 2, 0.5};

  AbsorptionTexture Read(const std::filesystem::path& mesh_file, const AbsorptionTextureSpec& spec) {
    scene.capture.layers[0].absorption_texture = spec;
    return {scene.capture, 0, mesh_file, 0};
  }
  AbsorptionTexture FromProperty(const std::function<double(const glm::dvec3&)>& factor) {
    mesh.vertex_properties.clear();
    for (const auto& v : mesh.vertices) mesh.vertex_properties["stain"].push_back(factor(v));
    WritePly(folder.path / "box.ply", mesh);
    return Read(folder.path / "box.ply", {{}, {"stain"}, 0, 1});
  }
};

TEST(AbsorptionTexture, VertexValuesAreInterpolatedInsideTheLayer) {
  TexturedBox box;
  const auto texture = box.FromProperty([](const glm::dvec3& p) { return 2.0 + 0.25 * p.x; });
  for (const glm::dvec3 p : {glm::dvec3(0, 0, 0), glm::dvec3(1.23, -0.7, -0.4), glm::dvec3(-3.1, 2.2, -0.9)})
    for (int c = 0; c < kChannels; ++c) EXPECT_NEAR(texture.At(p)[c], 2.0 + 0.25 * p.x, 1e-5);
}

TEST(AbsorptionTexture, ColoursOfEightBitsStandForZeroToOne) {
  TexturedBox box;
  for (const bool is_binary : {false, true})
    for (const char* type : {"uchar", "uint8"}) {
      std::ofstream ply(box.folder.path / "box.ply", std::ios::binary);
      ply << "ply\nformat " << (is_binary ? "binary_little_endian" : "ascii") << " 1.0\nelement vertex "
          << box.mesh.vertices.size() << "\nproperty float x\nproperty float y\nproperty float z\nproperty " << type
          << " red\nproperty " << type << " green\nproperty float blue\nelement face " << box.mesh.triangles.size()
          << "\nproperty list uchar int vertex_indices\nend_header\n";
      const auto put = [&](auto value) {
        if (is_binary)
          ply.write(reinterpret_cast<const char*>(&value), sizeof value);
        else
          ply << +value << " ";
      };
      for (const auto& v : box.mesh.vertices) {
        for (int k = 0; k < 3; ++k) put(static_cast<float>(v[k]));
        put(uint8_t{255}), put(uint8_t{51}), put(3.0f);
      }
      for (const auto& t : box.mesh.triangles) {
        put(uint8_t{3});
        for (int k = 0; k < 3; ++k) put(static_cast<int32_t>(t[k]));
      }
      ply.close();
      const auto texture = box.Read(box.folder.path / "box.ply", {{}, {"red", "green", "blue"}, 0, 2});
      EXPECT_NEAR(texture.At({1, 1, 0})[0], 2.0, 1e-5) << type;
      EXPECT_NEAR(texture.At({1, 1, 0})[1], 2.0 / 5, 1e-5) << type;
      EXPECT_NEAR(texture.At({1, 1, 0})[2], 6.0, 1e-5) << "a float stands for itself";
    }
}

TEST(AbsorptionTexture, ALinearFactorIntegratesToItsMeanTimesTheLength) {
  TexturedBox box;
  const auto texture = box.FromProperty([](const glm::dvec3& p) { return 2.0 + 0.25 * p.x; });
  const glm::dvec3 along = glm::normalize(glm::dvec3(1, 0.2, -0.1));
  for (const double length : {0.01, 0.3, 2.0})
    EXPECT_NEAR(texture.Along({-1, 0, -0.2}, along, length)[1], length * (2.0 + 0.25 * (-1 + 0.5 * length * along.x)),
                1e-5 * length);
}

TEST(AbsorptionTexture, ImageFollowsPlyAndObjTextureCoordinates) {
  TexturedBox box;
  Image picture(64, 64, 3);  // red falls to the right, green grows upwards
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      picture.at(x, y, 0) = static_cast<float>(1.0 - (x + 0.5) / 64);
      picture.at(x, y, 1) = static_cast<float>(1.0 - (y + 0.5) / 64);
      picture.at(x, y, 2) = 0.5f;
    }
  WriteImageFile(box.folder.path / "stain.exr", picture);
  const AbsorptionTextureSpec spec{box.folder.path / "stain.exr", {}, 1.0, 5.0};
  const auto uv = [](const glm::dvec3& v) { return glm::dvec2((v.x + 5) / 10, (v.y + 5) / 10); };

  TriangleMesh mesh = box.mesh;
  std::ofstream obj(box.folder.path / "box.obj");
  for (const auto& v : mesh.vertices) {
    mesh.vertex_properties["s"].push_back(uv(v).x);
    mesh.vertex_properties["t"].push_back(uv(v).y);
    obj << "v " << v.x << " " << v.y << " " << v.z << "\nvt " << uv(v).x << " " << uv(v).y << "\n";
  }
  for (const auto& t : mesh.triangles)
    obj << "f " << t.x + 1 << "/" << t.x + 1 << " " << t.y + 1 << "/" << t.y + 1 << " " << t.z + 1 << "/" << t.z + 1
        << "\n";
  obj.close();
  WritePly(box.folder.path / "box.ply", mesh);

  for (const char* file : {"box.ply", "box.obj"}) {
    const auto texture = box.Read(box.folder.path / file, spec);
    const glm::dvec3 p(1.5, -2.5, 0);
    EXPECT_NEAR(texture.At(p)[0], 1 + 4 * (1 - uv(p).x), 1e-3) << file;
    EXPECT_NEAR(texture.At(p)[1], 1 + 4 * uv(p).y, 1e-3) << file;
    EXPECT_NEAR(texture.At(p)[2], 3.0, 1e-5) << file;
  }
}

TEST(AbsorptionTexture, MissingOrInvalidFactorsAreRefused) {
  TexturedBox box;
  box.FromProperty([](const glm::dvec3&) { return 1.0; });
  const auto file = box.folder.path / "box.ply";
  WriteImageFile(box.folder.path / "grey.exr", Image(4, 4, 3, 0.5f));
  EXPECT_THROW(box.Read(file, {{}, {"absent"}, 0, 1}), InputError);
  EXPECT_THROW(box.Read(file, {box.folder.path / "grey.exr", {}, 0, 1}), InputError);  // no texture coordinates
  EXPECT_THROW(box.Read(file, {{}, {"stain"}, 0, 5000}), InputError);
  EXPECT_THROW(box.FromProperty([](const glm::dvec3&) { return std::nan(""); }), InputError);
}

/// A bead whose outer layer absorbs `absorption` times a texture of `factor` (0: no texture).
KnownScene Bead(const TemporaryFolder& folder, double absorption, double factor) {
  TriangleMesh sphere = Sphere(1.5, 24);
  sphere.vertex_properties["stain"].assign(sphere.vertices.size(), factor);
  WritePly(folder.path / "bead.ply", sphere);
  KnownScene scene(ReadMeshFile(folder.path / "bead.ply"), 2, 0.4, 6, 4.0);
  scene.capture.layers[0][Quantity::kAbsorption].value.fill(absorption);
  scene.Light(DiskLight{{200, 0, 200}, {-1, 0, -1}, glm::dvec3(2.0), 0.0, 90.0});
  scene.Light(DomeLight{glm::dvec3(0.1)});
  if (factor > 0) {
    scene.capture.layers[0].absorption_texture = {{}, {"stain"}, 0, 1};
    scene.source.absorption[0] = std::make_shared<AbsorptionTexture>(scene.capture, 0, folder.path / "bead.ply", 0);
  }
  return scene;
}

TEST(AbsorptionTexture, UniformTextureEqualsScaledAbsorptionInBothModels) {
  const TemporaryFolder folder;
  const KnownScene textured = Bead(folder, 0.1, 3.0), plain = Bead(folder, 0.3, 0.0);
  const auto walked = [](const KnownScene& scene) {
    const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0,
                           scene.source.absorption);
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {200, 1, 0, 0}, [](double) {});
  };
  const auto predicted = [](const KnownScene& scene) {
    CastState state;
    state.thickness_mm = StatedThicknesses(scene.capture);
    state.crown = scene.Build();
    state.photographs.push_back(scene.Cast(*state.crown));
    return PredictPixels(scene.capture, state, 0, StatedMaterial(scene.capture), StatedLightScales(scene.capture), 0);
  };
  const PathPhotograph a = walked(textured), b = walked(plain);  // identical paths
  for (size_t p = 0; p < a.pixels.size(); ++p) EXPECT_NEAR(a.pixels[p].mean[1], b.pixels[p].mean[1], 1e-4);
  const auto c = predicted(textured), d = predicted(plain);
  // The shader attenuates light by its mean path in the layer. More absorption shortens that path: 2 % at three times
  // as much.
  for (size_t p = 0; p < c.size(); ++p) EXPECT_NEAR(c[p][1], d[p][1], 0.03 * d[p][1]);
}

}  // namespace
}  // namespace crownfit
