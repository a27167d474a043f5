// The random walk: boundaries that lose nothing, walks that agree with closed forms, pictures that do not depend on how
// the scene is cut into triangles, units or threads.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/mesh_file.h"
#include "optics/adding_doubling.h"
#include "support/known_scene.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"
#include "walk/boundary.h"
#include "walk/flight_lanes.h"
#include "walk/path_photograph.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

/// Mean and standard error of independent samples.
struct Mean {
  double sum = 0, square = 0;
  int n = 0;
  double stated = 0;  ///< standard error from elsewhere
  void Add(double x) { sum += x, square += x * x, ++n; }
  double value() const { return sum / n; }
  double error() const { return std::sqrt(std::max(0.0, square / n - value() * value()) / (n - 1)); }
};

glm::dvec3 Towards(double polar, double azimuth) {
  return {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)};
}

TEST(PhaseFunction, MeanCosineIsTheAsymmetryTimesTheShareThatIsNotIsotropic) {
  for (const auto& [g, isotropic] :
       {std::pair{0.0, 0.0}, {5e-4, 0.0}, {0.68, 0.0}, {0.96, 0.0}, {-0.5, 0.0}, {0.93, 0.35}}) {
    const Medium m{1.5, g, isotropic};
    RandomStream random(Key(1, g * 1e4));
    Mean first, second;
    for (int i = 0; i < 200000; ++i) {
      const double cosine = glm::dot(SamplePhaseFunction(m, {0, 0.6, 0.8}, random), {0, 0.6, 0.8});
      first.Add(cosine);
      second.Add(1.5 * cosine * cosine - 0.5);  // second Legendre moment: g^2
    }
    EXPECT_NEAR(first.value(), (1 - isotropic) * g, 4 * first.error()) << g;
    EXPECT_NEAR(second.value(), (1 - isotropic) * g * g, 4 * second.error()) << g;
  }
}

class RoughBoundary : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(RoughBoundary, StatedDensitiesAreThoseOfTheSampledDirections) {
  // For light from either side at several angles: the stated density integrates, over the sky and weighted with a
  // function that tells directions apart, to what the sampled directions give.
  const auto [roughness, wetness] = GetParam();
  const OuterBoundary boundary{roughness, wetness, 1.62, 1.0};
  const glm::dvec3 normal(0, 0, 1);
  for (const bool from_outside : {true, false}) {
    for (const double polar : {0.1, 0.7, 1.3}) {
      glm::dvec3 direction = -Towards(polar, 0.4);
      if (!from_outside) direction.z = -direction.z;
      RandomStream random(Key(7, from_outside, polar * 10, roughness * 100));
      Mean sampled[2], stated[2];
      for (int i = 0; i < 300000; ++i) {
        const glm::dvec3 lamp = Towards(std::acos(std::sqrt(random.Next())), 2 * kPi * random.Next());
        TargetDensity density;
        const Scattered s = boundary.Scatter(direction, normal, random, {&lamp, 1}, {&density, 1});
        const bool leaves = s.direction.z > 0 && s.density != kMirror;  // the mirror of a film is no target's share
        EXPECT_NEAR(glm::length(s.direction), 1.0, 1e-9);
        sampled[0].Add(leaves);
        sampled[1].Add(leaves ? s.direction.x * s.direction.x - 0.3 * s.direction.y : 0.0);
        const double weight = density.estimate * kPi / lamp.z;
        stated[0].Add(weight);
        stated[1].Add(weight * (lamp.x * lamp.x - 0.3 * lamp.y));
      }
      for (int k = 0; k < 2; ++k)
        EXPECT_NEAR(sampled[k].value(), stated[k].value(), 4.5 * std::hypot(sampled[k].error(), stated[k].error()))
            << roughness << " " << wetness << (from_outside ? " from outside " : " from inside ") << polar;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Roughness, RoughBoundary,
                         testing::Values(std::tuple{0.2, 0.0}, std::tuple{0.6, 0.0}, std::tuple{1.0, 0.0},
                                         std::tuple{0.3, 1.0}, std::tuple{0.5, 0.5}));

TEST(RoughBoundary, IsReciprocalInReflectionAndTransmission) {
  // Density over n^2 cos of where light goes is symmetric: nothing distinguishes the way there from the way back.
  const double n = 1.62, roughness = 0.5;
  const glm::dvec3 a = Towards(0.4, 0.1), b = Towards(1.2, 1.9);
  RandomStream random(11);
  const auto density = [&](const glm::dvec3& from, const glm::dvec3& to, double ior) {
    Mean mean;
    for (int i = 0; i < 400000; ++i) {
      TargetDensity d;
      ScatterOnMicrosurface(from, ior, roughness, random, {&to, 1}, {&d, 1});
      mean.Add(d.estimate);
    }
    return mean;
  };
  const Mean ab = density(a, b, n), ba = density(b, a, n);
  EXPECT_NEAR(ab.value() / b.z, ba.value() / a.z, 4 * std::hypot(ab.error() / b.z, ba.error() / a.z));
  // Down through the surface along -c, and back up: from below, below is above.
  const glm::dvec3 c = Towards(0.5, 3.4);
  const Mean down = density(a, -c, n), up = density(c, -a, 1 / n);
  EXPECT_NEAR(down.value() / (n * n * c.z), up.value() / a.z,
              4 * std::hypot(down.error() / (n * n * c.z), up.error() / a.z));
}

TEST(RoughBoundary, TendsToTheSmoothOne) {
  const OuterBoundary rough{2e-3, 0.0, 1.5, 1.0};
  RandomStream random(5);
  Mean reflected;
  for (int i = 0; i < 100000; ++i)
    reflected.Add(rough.Scatter(-Towards(kPi / 3, 0), {0, 0, 1}, random, {}, {}).direction.z > 0);
  EXPECT_NEAR(reflected.value(), 0.0891867128, 4 * reflected.error());  // Fresnel at 60 degrees, 1 to 1.5
}

LayeredBody BodyOf(const KnownScene& scene) {
  return {BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0};
}

/// Mean over the pixels on the object, of the green channel, with the standard error that the pixels state.
Mean RenderedMean(const KnownScene& scene, int paths, uint64_t seed = 1) {
  const LayeredBody body = BodyOf(scene);
  const PathPhotograph photo = RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0,
                                             {paths, seed, 0, 0}, [](double) {});
  EXPECT_LE(photo.counters.lost_share(), 1e-5);
  Mean mean;
  double variance = 0;
  for (const PixelEstimate& p : photo.pixels)
    if (p.on_object) mean.Add(p.mean.y), variance += p.covariance[3];
  mean.stated = std::sqrt(variance) / mean.n;
  return mean;
}

void SetLayer(KnownScene& scene, size_t layer, double ior, double g, double reduced_scattering, double absorption) {
  LayerSpec& l = scene.capture.layers[layer];
  l[Quantity::kIor].value.fill(ior);
  l[Quantity::kAsymmetry].value.fill(g);
  l[Quantity::kReducedScattering].value.fill(reduced_scattering);
  l[Quantity::kAbsorption].value.fill(absorption);
}

void SetSurface(KnownScene& scene, double roughness, double wetness) {
  scene.capture.surface[static_cast<size_t>(Quantity::kRoughness)].value.fill(roughness);
  scene.capture.surface[static_cast<size_t>(Quantity::kWetness)].value.fill(wetness);
}

/// Six lamps of radiance 1/pi that close a cube around the object: a furnace whose light is found by sampling lamps.
void LampCube(KnownScene& scene) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      glm::dvec3 centre(0.0), u(0.0), v(0.0);
      centre[axis] = side * 400;
      u[(axis + 1) % 3] = 400;
      v[(axis + 2) % 3] = -side * 400;  // shines along u x v, inwards
      scene.Light(RectangleLight{centre, u, v, glm::dvec3(1.0 / kPi)});
    }
}

struct FurnaceCase {
  const char* name;
  TriangleMesh mesh;
  int layers;
  double roughness, wetness;
};

TEST(WhiteFurnace, EveryMaterialWithoutAbsorptionDisappears) {
  // Under a dome of radiance 1/pi, and in a closed cube of lamps (which tests the sampling of lamps and its weights).
  const FurnaceCase cases[] = {
      {"smooth", Sphere(1.5, 12), 1, 0.0, 0.0},         {"rough 0.05", Sphere(1.5, 12), 1, 0.05, 0.0},
      {"rough 0.3", Sphere(1.5, 12), 1, 0.3, 0.0},      {"rough 0.6", Sphere(1.5, 12), 1, 0.6, 0.0},
      {"layered", Sphere(1.5, 12), 2, 0.2, 0.0},        {"wet", Sphere(1.5, 12), 1, 0.3, 0.6},
      {"wet and smooth", Sphere(1.5, 12), 1, 0.0, 1.0}, {"concave", Cup(1.8, 2.0, 0.5), 1, 0.15, 0.0},
  };
  for (const FurnaceCase& c : cases) {
    for (const bool dome : {true, false}) {
      KnownScene scene(c.mesh, c.layers, 0.4, 6, 1.8);  // nothing but the object is in the picture
      SetLayer(scene, 0, 1.62, 0.6, 2.0, 0.0);
      if (c.layers > 1) SetLayer(scene, 1, 1.54, 0.8, 5.0, 0.0);
      SetSurface(scene, c.roughness, c.wetness);
      if (dome) {
        scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
      } else {
        LampCube(scene);
      }
      const Mean mean = RenderedMean(scene, 300);
      EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-6) << c.name << (dome ? ", dome" : ", lamps");
    }
  }
}

TEST(WhiteFurnace, WhiteSceneryAndBackingAroundTheObjectDisappearToo) {
  KnownScene scene(Sphere(1.2, 12), 1, 0.4, 6, 1.4);
  SetLayer(scene, 0, 1.54, 0.0, 3.0, 0.0);
  SetSurface(scene, 0.3, 0.0);
  scene.capture.backings.push_back({"white", {0, 0, -1.4}, {0, 0, 1}, 8.0, glm::dvec3(1.0)});
  scene.capture.photographs[0].backing = 0;
  scene.capture.scenery.push_back({"neighbour", "", glm::dvec3(1.0)});
  scene.scenery.push_back(Box({1.3, -1, -1}, {2.0, 1, 1}));
  scene.capture.photographs[0].scenery = {0};
  LampCube(scene);
  const Mean mean = RenderedMean(scene, 600);
  EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated);
}

/// The mesh closed as a file's would be.
TriangleMesh Closed(const TriangleMesh& mesh) {
  const TemporaryFolder folder;
  std::vector<std::string> messages;
  WritePly(folder.path / "m.ply", mesh);
  return ReadClosedSurface(folder.path / "m.ply", messages);
}

TEST(WhiteFurnace, OpenScansAndLayersThatStandOutOfEachOtherDisappearToo) {
  const glm::dvec3 below(0, 0, -0.9);
  TriangleMesh root = Sphere(1.2, 24);
  for (auto& v : root.vertices) v = 0.999 * v + below;
  const TriangleMesh cap = Closed(OpenBelow(Sphere(1.5, 24), -0.8));
  for (const Neck neck : {Neck::kAir, Neck::kRoot}) {
    for (const bool with_root : {false, true}) {
      // Seen from the side; without a root the inner layer is an offset that ends at the cut.
      KnownScene scene(cap, 2, 0.4, 8, 1.4);
      RigidTransform& pose = scene.capture.photographs[0].camera_from_object;
      pose.rotation = glm::dmat3(glm::dvec3(1, 0, 0), glm::dvec3(0, 0, 1), glm::dvec3(0, -1, 0));
      if (with_root) pose.translation_mm.y = -0.5;
      if (with_root) scene.source.meshes[1] = root;
      scene.capture.neck = with_root ? Neck::kAir : neck;
      SetLayer(scene, 0, 1.62, 0.6, 2.0, 0.0);
      SetLayer(scene, 1, 1.54, 0.8, 5.0, 0.0);
      SetSurface(scene, 0.2, 0.0);
      scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
      const Mean mean = RenderedMean(scene, 300);
      EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-6) << static_cast<int>(neck) << with_root;
      EXPECT_EQ(mean.n, 64);
    }
  }
}

TEST(Path, WhichOfTwoOverlappingLayersIsTheInnerOneDoesNotMatterWhenTheyAreOfOneMaterial) {
  // Two spheres side by side that overlap; the object is their union, so swapping them mirrors nothing but names.
  TriangleMesh left = Sphere(1.0, 24), right = left;
  for (auto& v : left.vertices) v.x -= 0.6;
  for (auto& v : right.vertices) v.x += 0.6;
  Mean means[2];
  for (const bool swapped : {false, true}) {
    KnownScene scene(swapped ? right : left, 2, 0.4, 12, 3.6);
    scene.source.meshes[1] = swapped ? left : right;
    for (size_t l : {0, 1}) SetLayer(scene, l, 1.5, 0.7, 1.0, 0.1);
    SetSurface(scene, 0.2, 0.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
    means[swapped] = RenderedMean(scene, 1000, 1 + swapped);
  }
  EXPECT_EQ(means[0].n, means[1].n);
  EXPECT_NEAR(means[0].value(), means[1].value(), 4 * std::hypot(means[0].stated, means[1].stated));
  EXPECT_LT(means[0].stated, 0.003 * means[0].value());
}

TEST(Path, ANeckThatAbsorbsDarkensAndARootLiesBetween) {
  const auto seen_with = [](Neck neck, double neck_return) {
    KnownScene scene(Closed(OpenBelow(Sphere(1.5, 24), -0.8)), 1, 0.4, 8, 2.6);
    scene.capture.neck = neck;
    SetLayer(scene, 0, 1.54, 0.8, 1.0, 0.02);
    SetSurface(scene, 0.2, 0.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
    scene.capture.surface[static_cast<size_t>(Quantity::kNeckReturn)].value.fill(neck_return);
    return RenderedMean(scene, 300).value();
  };
  const double root = seen_with(Neck::kRoot, 1.0), absorbing = seen_with(Neck::kAbsorbing, 1.0);
  EXPECT_GT(seen_with(Neck::kAir, 1.0), root + 0.02);
  EXPECT_GT(root, absorbing + 0.05);
  EXPECT_EQ(seen_with(Neck::kRoot, 0.0), absorbing);
}

TEST(Path, WhiteTileShowsTheRadiometryOfTheContract) {
  // Lamps at 300 mm and more, facing the tile or at 60 degrees; the object is out of sight.
  const auto tile = [](const LightShape& light) {
    KnownScene scene(Box({-0.1, -0.1, -60.2}, {0.1, 0.1, -60}), 1, 0.1, 4, 2.0);
    scene.capture.scenery.push_back({"tile", "", glm::dvec3(1.0)});
    scene.scenery.push_back(SquareTile(glm::dvec3(0.0), {0, 0, 1}, 20));
    scene.capture.photographs[0].scenery = {0};
    scene.Light(light);
    const LayeredBody body = BodyOf(scene);
    const PathPhotograph photo = RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0,
                                               {1000, 1, 0, 0}, [](double) {});
    Mean mean;
    double variance = 0;
    for (const PixelEstimate& p : photo.pixels) mean.Add(p.mean.y), variance += p.covariance[3];
    mean.stated = std::sqrt(variance) / mean.n;
    return mean;
  };
  const auto expect = [&](const LightShape& light, double value) {
    const Mean mean = tile(light);
    EXPECT_NEAR(mean.value(), value, 4 * mean.stated + 2e-4 * value);
  };
  const double degree = kPi / 180;
  expect(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), degree}, 1.0);
  expect(DirectionalLight{{std::sin(60 * degree), 0, 0.5}, glm::dvec3(1.0), degree}, 0.5);
  expect(PointLight{{0, 0, 250}, glm::dvec3(62500.0), 250 * degree}, 1.0);
  expect(DomeLight{glm::dvec3(1.0 / kPi)}, 1.0);
  Image picture(16, 8, 3);
  std::fill(picture.values.begin(), picture.values.end(), static_cast<float>(1.0 / kPi));
  expect(EnvironmentLight{std::make_shared<EnvironmentMap>(picture), glm::dvec3(1.0)}, 1.0);
  expect(DiskLight{{0, 0, 100}, {0, 0, -1}, glm::dvec3(2.0), 20.0, 40.0},
         2 * kPi * (40.0 * 40.0 / (40.0 * 40.0 + 100.0 * 100.0) - 20.0 * 20.0 / (20.0 * 20.0 + 100.0 * 100.0)));
}

TEST(Path, DiscOnATileShowsTheReflectanceOfTheSlabWithItsBacking) {
  // A disc so wide that nothing leaves at its rim, under a dome of radiance 1/pi: by reciprocity a pixel seen straight
  // on is the reflectance of collimated light, surface included.
  for (const bool in_contact : {false, true}) {
    KnownScene scene(Box({-25, -25, -1}, {25, 25, 0}), 1, 1.0, 2, 0.5);
    SetLayer(scene, 0, 1.54, 0.8, 2.0, 0.05);
    SetSurface(scene, 0.0, 0.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
    scene.capture.backings.push_back({"tile", {0, 0, in_contact ? -1.0 : -1.001}, {0, 0, 1}, 100.0, glm::dvec3(0.7)});
    scene.capture.backings[0].in_contact = in_contact;
    scene.capture.photographs[0].backing = 0;
    Slab slab;
    slab.layers = {{1.54, 0.8, 0.0, 10.0, 0.05, 1.0}};
    slab.backing_reflectance = 0.7;
    slab.backing_contact = in_contact;
    const SlabAnswer answer = SolveByAddingDoubling(slab);
    const Mean mean = RenderedMean(scene, 10000);
    EXPECT_NEAR(mean.value(), answer.specular + answer.value.reflectance_collimated, 4 * mean.stated) << in_contact;
    EXPECT_LT(mean.stated, 0.003);
  }
}

TEST(Path, ClearAbsorbingSlabFollowsBeerAndFresnel) {
  // No scattering: through a clear plate between a lamp behind and the camera, every internal reflection counted.
  KnownScene scene(Box({-30, -30, -2}, {30, 30, 0}), 1, 2.0, 2, 0.2);
  SetLayer(scene, 0, 1.5, 0.0, 0.0, 0.2);
  SetSurface(scene, 0.0, 0.0);
  scene.Light(DirectionalLight{{0, 0, -1}, glm::dvec3(1.0), 0.2});
  const double radiance = 1.0 / (kPi * std::pow(std::sin(0.2), 2)), f = 0.04, a = std::exp(-0.4);
  const Mean mean = RenderedMean(scene, 40000);
  EXPECT_NEAR(mean.value(), kPi * radiance * (1 - f) * (1 - f) * a / (1 - f * f * a * a), 4 * mean.stated);
}

/// A grey sphere with a core under a lamp and a dome: something to compare with itself.
KnownScene Bead(double scale = 1.0, int rings = 24) {
  KnownScene scene(Sphere(1.5 * scale, rings), 2, 0.4 * scale, 6, 4.0);
  SetLayer(scene, 0, 1.62, 0.6, 1.0 / scale, 0.05 / scale);
  SetLayer(scene, 1, 1.54, 0.8, 3.0 / scale, 0.2 / scale);
  SetSurface(scene, 0.3, 0.0);
  scene.Light(DiskLight{{200, 0, 200}, {-1, 0, -1}, glm::dvec3(2.0), 0.0, 90.0});
  scene.Light(DomeLight{glm::dvec3(0.1)});
  return scene;
}

TEST(Path, FinerTrianglesOfTheSameSurfaceChangeNothing) {
  KnownScene coarse = Bead(), fine = Bead();
  // Both cores from the same field: only the cut into triangles differs.
  fine.source.meshes[0] = Refined(*coarse.source.meshes[0], 0.1);
  fine.source.fields = coarse.source.fields;
  const Mean a = RenderedMean(coarse, 4000, 1), b = RenderedMean(fine, 4000, 2);
  EXPECT_NEAR(a.value(), b.value(), 4 * std::hypot(a.stated, b.stated));
}

TEST(Path, UnitsOfLengthDoNotMatter) {
  KnownScene small = Bead(), large = Bead(1000.0);
  large.capture.photographs[0].camera_from_object.translation_mm *= 1000.0;
  large.capture.lights[0].shape =
      DiskLight{{2e5, 0, 2e5}, glm::normalize(glm::dvec3(-1, 0, -1)), glm::dvec3(2.0), 0.0, 9e4};
  const Mean a = RenderedMean(small, 4000, 1), b = RenderedMean(large, 4000, 2);
  EXPECT_NEAR(a.value(), b.value(), 4 * std::hypot(a.stated, b.stated));
}

TEST(Path, SamePictureForAnyNumberOfThreads) {
  const KnownScene scene = Bead();
  const LayeredBody body = BodyOf(scene);
  std::vector<PathPhotograph> photos;
  for (const int threads : {1, 3})
    photos.push_back(
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {20, 1, 0, threads}, [](double) {}));
  for (size_t p = 0; p < photos[0].pixels.size(); ++p) {
    EXPECT_EQ(photos[0].pixels[p].mean, photos[1].pixels[p].mean);
    EXPECT_EQ(photos[0].pixels[p].covariance, photos[1].pixels[p].covariance);
  }
}

TEST(Path, SamePictureForAnyNumberOfLanes) {
  // Three heroes, a texture-free outer layer, a rough boundary: every kind of event.
  KnownScene scene(Incisor(), 2, 0.9, 10, 6.0);
  scene.capture.layers[1][Quantity::kReducedScattering].value = {2.5, 2.0, 1.5};
  scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 65.0});
  const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0);
  PathOptions options{.paths_per_pixel = 12};
  const auto render = [&](int lanes) {
    options.lanes = lanes;
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  };
  const PathPhotograph reference = render(64);
  for (const int lanes : {1, 3, 17, 128}) {
    const PathPhotograph other = render(lanes);
    EXPECT_EQ(other.counters.flights, reference.counters.flights);
    for (size_t i = 0; i < other.pixels.size(); ++i) {
      EXPECT_EQ(other.pixels[i].mean, reference.pixels[i].mean) << lanes << " lanes, pixel " << i;
      EXPECT_EQ(other.pixels[i].covariance, reference.pixels[i].covariance) << lanes << " lanes, pixel " << i;
    }
  }
}

TEST(Path, EveryWayOfTracingAndOfFindingLampsGivesTheSamePicture) {
  // Facets in double precision by the grid against rays in single precision; lamps by chance against both ways at once.
  for (const double roughness : {0.0, 0.3}) {
    KnownScene scene(Incisor(50), 2, 0.9, 8, 12.0);
    scene.capture.layers[1][Quantity::kReducedScattering].value = {2.5, 2.0, 1.5};
    SetSurface(scene, roughness, 0.0);
    scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 90.0});
    const LayeredBody body = BodyOf(scene);
    const auto render = [&](uint64_t seed, int lanes, bool lamps_are_sampled) {
      PathOptions options{.paths_per_pixel = 1500, .seed = seed};
      options.lanes = lanes;
      options.lamps_are_sampled = lamps_are_sampled;
      return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
    };
    const PathPhotograph a = render(1, 64, true), b = render(2, 0, true), c = render(3, 64, false);
    for (const PathPhotograph* other : {&b, &c}) {
      double difference = 0, variance = 0, sum = 0;
      for (size_t p = 0; p < a.pixels.size(); ++p) {
        difference += other->pixels[p].mean.y - a.pixels[p].mean.y;
        sum += a.pixels[p].mean.y;
        variance += other->pixels[p].variance().y + a.pixels[p].variance().y;
      }
      EXPECT_LT(std::abs(difference), 3.5 * std::sqrt(variance)) << roughness << (other == &b ? " rays" : " chance");
      EXPECT_LT(std::sqrt(variance), 0.03 * sum);
    }
  }
}

TEST(FlightLanes, DrawAndScatterAsOneWalkAloneDoes) {
  // No surface anywhere near: flights and directions against the scalar functions.
  TriangleMesh mesh = Incisor();
  for (glm::dvec3& v : mesh.vertices) v *= 1e4;
  const LayeredBody body({mesh}, 0);
  FlightLanes lanes{};
  constexpr int kCount = 37;
  std::vector<RandomStream> streams;
  std::vector<Medium> media;
  std::vector<glm::dvec3> directions;
  for (int i = 0; i < kCount; ++i) {
    Medium medium;
    medium.g = i % 3 == 0 ? 0.0 : 0.027 * i - 0.1;
    medium.isotropic_fraction = i % 2 ? 0.3 : 0.0;
    media.push_back(medium);
    streams.emplace_back(Key(5, i));
    directions.push_back(glm::normalize(glm::dvec3(i - 18, 3, 9 - i)));
    lanes.dx[i] = directions[i].x, lanes.dy[i] = directions[i].y, lanes.dz[i] = directions[i].z;
    lanes.random[i] = streams[i].state();
    lanes.random_step[i] = streams[i].step();
    lanes.free_path_mm[i] = 0.5;
    lanes.g[i] = medium.g;
    lanes.isotropic_fraction[i] = medium.isotropic_fraction;
  }
  std::vector<double> length(kCount, 0.0);
  for (int step = 0; step < 200; ++step) {
    lanes.Fly(body.grid, kCount);
    lanes.Scatter(kCount);
    for (int i = 0; i < kCount; ++i) {
      ASSERT_EQ(lanes.collides[i], 1.0);
      length[i] += -std::log(1.0 - streams[i].Next()) * 0.5;
      directions[i] = SamplePhaseFunction(media[i], directions[i], streams[i]);
      ASSERT_NEAR(lanes.length_mm[i], length[i], 1e-12 * (1 + length[i]));
      const glm::dvec3 d(lanes.dx[i], lanes.dy[i], lanes.dz[i]);
      ASSERT_NEAR(glm::length(d), 1.0, 1e-14);
      ASSERT_LT(glm::distance(d, directions[i]), 1e-11) << "lane " << i << ", step " << step;
      directions[i] = d;  // so that differences do not grow
      ASSERT_EQ(lanes.random[i], streams[i].state());
    }
  }
}

TEST(Path, StatedErrorsAreThoseOfThirtySeeds) {
  // Scatter of every pixel over 30 seeds against the variance it states, for shared paths and for groups of three
  // heroes.
  for (const bool alike : {true, false}) {
    KnownScene scene = Bead();
    scene.source.meshes[1] = Sphere(1.1, 12);
    if (!alike) scene.capture.layers[1][Quantity::kReducedScattering].value = {2, 6, 9};
    const LayeredBody body = BodyOf(scene);
    const Material material = StatedMaterial(scene.capture);
    constexpr int kSeeds = 30;
    std::vector<PathPhotograph> photos;
    for (int seed = 1; seed <= kSeeds; ++seed)
      photos.push_back(RenderByPaths(scene.capture, body, {}, material, 0, {90, uint64_t(seed), 0, 0}, [](double) {}));
    double ratios = 0, count = 0;
    for (size_t p = 0; p < photos[0].pixels.size(); ++p)
      for (int c = 0; c < 3; ++c) {
        double sum = 0, square = 0, stated = 0;
        for (const auto& photo : photos) {
          const double v = photo.pixels[p].mean[c];
          sum += v, square += v * v, stated += photo.pixels[p].variance()[c] / kSeeds;
        }
        if (!photos[0].pixels[p].on_object) continue;
        ratios += (square - sum * sum / kSeeds) / (kSeeds - 1) / stated;
        ++count;
      }
    const double ratio = std::sqrt(ratios / count);
    EXPECT_GT(ratio, 0.8) << (alike ? "alike" : "heroes");
    EXPECT_LT(ratio, 1.25) << (alike ? "alike" : "heroes");
    std::printf("scatter over stated error, %s: %.3f\n", alike ? "shared paths" : "three heroes", ratio);
  }
}

TEST(Path, ChannelsThatScatterDifferentlyAgreeWithEachAlone) {
  // Spectral multiple importance sampling against grey runs, for coefficients as far apart as 2, 6 and 9.
  const double s[3] = {2, 6, 9};
  KnownScene together = Bead();
  for (int c = 0; c < 3; ++c) {
    together.capture.layers[0][Quantity::kReducedScattering].value[c] = s[c];
    together.capture.layers[1][Quantity::kReducedScattering].value[c] = s[2 - c];
  }
  const LayeredBody body = BodyOf(together);
  const auto render = [&](const KnownScene& scene, int paths) {
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {paths, 3, 0, 0}, [](double) {});
  };
  const PathPhotograph all = render(together, 6000);
  for (int c = 0; c < 3; ++c) {
    KnownScene alone = together;
    alone.capture.layers[0][Quantity::kReducedScattering].value.fill(s[c]);
    alone.capture.layers[1][Quantity::kReducedScattering].value.fill(s[2 - c]);
    const PathPhotograph one = render(alone, 3000);
    double difference = 0, variance = 0;
    for (size_t p = 0; p < all.pixels.size(); ++p) {
      difference += all.pixels[p].mean[c] - one.pixels[p].mean[c];
      variance += all.pixels[p].variance()[c] + one.pixels[p].variance()[c];
    }
    EXPECT_LT(std::abs(difference), 4 * std::sqrt(variance)) << c;
  }
}

TEST(Path, LampAndCameraMayChangePlaces) {
  // Reciprocity: a small bright disk at A seen from B gives the same as one at B seen from A, when both subtend the
  // same few degrees and the "camera" is the mean over a picture that sees the whole body.
  const auto look = [](const glm::dvec3& lamp, bool swap, uint64_t seed) {
    KnownScene scene = Bead();
    scene.capture.lights.clear();
    scene.capture.photographs[0].lights.clear();
    SetSurface(scene, 0.4, 0.0);
    RigidTransform& pose = scene.capture.photographs[0].camera_from_object;
    glm::dvec3 place = lamp;
    if (swap) {  // camera at the lamp's place, looking at the origin
      const glm::dvec3 z = -glm::normalize(lamp), x = glm::normalize(glm::cross(glm::dvec3(0, 1, 0), z)),
                       y = glm::cross(z, x);
      pose.rotation = glm::transpose(glm::dmat3(x, y, z));
      pose.translation_mm = {0, 0, glm::length(lamp)};
      place = {0, 0, 250};
    }
    scene.Light(DiskLight{place, -glm::normalize(place), glm::dvec3(100.0), 0.0, 12.0});
    const LayeredBody body = BodyOf(scene);
    const PathPhotograph photo =
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, {3000, seed, 0, 0}, [](double) {});
    Mean mean;
    double variance = 0;
    for (const PixelEstimate& p : photo.pixels) mean.Add(p.mean.y), variance += p.covariance[3];
    mean.stated = std::sqrt(variance) / mean.n;
    return mean;
  };
  const glm::dvec3 lamp = 250.0 * Towards(1.1, 0.7);
  const Mean there = look(lamp, false, 1), back = look(lamp, true, 2);
  EXPECT_NEAR(there.value(), back.value(), 4 * std::hypot(there.stated, back.stated) + 2e-3 * there.value());
}

}  // namespace
}  // namespace crownfit
