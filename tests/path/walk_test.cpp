// The random walk: lossless boundaries, agreement with closed forms, furnaces and radiometry.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/mesh_file.h"
#include "optics/adding_doubling.h"
#include "optics/fresnel_moments.h"
#include "path/boundary.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"
#include "support/walked.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

TEST(PhaseFunction, MomentsMatchAsymmetryAndIsotropicFraction) {
  for (const auto& [g, isotropic] :
       {std::pair{0.0, 0.0}, {5e-4, 0.0}, {0.68, 0.0}, {0.96, 0.0}, {-0.5, 0.0}, {0.93, 0.35}}) {
    const Medium m{1.5, g, isotropic};
    RandomStream random(Key(1, static_cast<int>(g * 1e4)));
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

TEST_P(RoughBoundary, DensityMatchesSampledDirections) {
  // For light from either side at several angles, the stated density is integrated over the sky. The weight is a
  // function that distinguishes directions. The integral must match the sampled directions.
  const auto [roughness, wetness] = GetParam();
  const OuterBoundary boundary{roughness, wetness, 1.62, 1.0};
  const glm::dvec3 normal(0, 0, 1);
  for (const bool from_outside : {true, false}) {
    for (const double polar : {0.1, 0.7, 1.3}) {
      glm::dvec3 direction = -Towards(polar, 0.4);
      if (!from_outside) direction.z = -direction.z;
      RandomStream random(Key(7, from_outside, static_cast<int>(polar * 10), static_cast<int>(roughness * 100)));
      Mean sampled[2], stated[2];
      for (int i = 0; i < 300000; ++i) {
        const glm::dvec3 lamp = Towards(std::acos(std::sqrt(random.Next())), 2 * kPi * random.Next());
        TargetDensity density;
        const Scattered s = boundary.Scatter(direction, normal, random, {&lamp, 1}, {&density, 1});
        const bool leaves = s.direction.z > 0 && s.density != kMirror;  // targets exclude a film's mirror
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
  // The density divided by n^2 cos of the outgoing direction is symmetric: both directions along a path are equivalent.
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

TEST(RoughBoundary, ConvergesToTheSmoothBoundary) {
  const OuterBoundary rough{2e-3, 0.0, 1.5, 1.0};
  RandomStream random(5);
  Mean reflected;
  for (int i = 0; i < 100000; ++i)
    reflected.Add(rough.Scatter(-Towards(kPi / 3, 0), {0, 0, 1}, random, {}, {}).direction.z > 0);
  EXPECT_NEAR(reflected.value(), 0.0891867128, 4 * reflected.error());  // Fresnel at 60 degrees, 1 to 1.5
}

TEST(RoughBoundary, TransmitsStraightThroughAtMatchedIndices) {
  // From a layer into the outer medium, or through a film of water of the outer index. A lamp over the whole sky finds
  // all light, by lamp samples or by surface samples. Facets bend light by the step times a slope that is seldom large.
  for (const double roughness : {0.01, 0.3})
    for (const double wetness : {0.0, 0.5, 1.0})
      for (const double step : {0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11, 1e-10, 1e-9, 2e-9, 1e-8, 1e-6, 1e-4}) {
        const double open = wetness > 0 ? kFilmIor : 1.0, lamp_density = 1.0 / (2 * kPi);
        const OuterBoundary boundary{roughness, wetness, open * (1.0 + step), open};
        for (const double polar : {0.1, 0.7, 1.3}) {
          const glm::dvec3 direction = Towards(polar, 0.4);
          RandomStream random(13);
          Mean found;
          double farthest = 0;
          for (int i = 0; i < 2000; ++i) {
            const glm::dvec3 lamp = Towards(std::acos(random.Next()), 2 * kPi * random.Next());
            TargetDensity d;
            const Scattered s = boundary.Scatter(direction, {0, 0, 1}, random, {&lamp, 1}, {&d, 1});
            const double share = s.density == kMirror ? 1.0 : s.density / (s.density + lamp_density);
            found.Add((s.direction.z > 0 ? share : 0.0) + d.estimate / (d.approximate + lamp_density));
            farthest = std::max(farthest, glm::length(s.direction - direction));
          }
          EXPECT_NEAR(found.value(), 1.0, 1e-3) << roughness << " " << wetness << " " << step << " " << polar;
          EXPECT_LE(farthest, 1e3 * step + 1e-15) << roughness << " " << wetness << " " << step << " " << polar;
        }
      }
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

TEST(WhiteFurnace, NonAbsorbingMaterialsDisappear) {
  // Under a dome of radiance 1/pi, and in a closed cube of lamps (which tests the sampling of lamps and its weights).
  const FurnaceCase cases[] = {
      {"smooth", Sphere(1.5, 12), 1, 0.0, 0.0},         {"rough 0.05", Sphere(1.5, 12), 1, 0.05, 0.0},
      {"rough 0.3", Sphere(1.5, 12), 1, 0.3, 0.0},      {"rough 0.6", Sphere(1.5, 12), 1, 0.6, 0.0},
      {"layered", Sphere(1.5, 12), 2, 0.2, 0.0},        {"wet", Sphere(1.5, 12), 1, 0.3, 0.6},
      {"wet and smooth", Sphere(1.5, 12), 1, 0.0, 1.0}, {"concave", Cup(1.8, 2.0, 0.5), 1, 0.15, 0.0},
  };
  for (const FurnaceCase& c : cases) {
    for (const bool dome : {true, false}) {
      KnownScene scene(c.mesh, c.layers, 0.4, 6, 1.8);  // only the object is in the image
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

TEST(WhiteFurnace, IndexMatchedRoughSurfacesDisappear) {
  for (const double roughness : {0.01, 0.3})
    for (const double step : {0.0, 1e-15, 1e-13, 1e-11, 2e-9, 1e-6}) {
      KnownScene scene(Sphere(1.5, 12), 1, 0.4, 6, 1.8);
      SetLayer(scene, 0, 1.0 + step, 0.6, 2.0, 0.0);
      SetSurface(scene, roughness, 0.0);
      LampCube(scene);
      const Mean mean = RenderedMean(scene, 50);  // paths that all return 1 have no scatter
      EXPECT_NEAR(mean.value(), 1.0, 1e-3) << roughness << " " << step;
    }
}

TEST(WhiteFurnace, ExtremeMaterialsAndTouchingLayersDisappear) {
  struct Case {
    const char* name;
    double thickness_mm, outer_g, outer_scattering, inner_scattering;  // reduced, per mm
    int paths;
  };
  const Case cases[] = {
      {"forward peak of 1000", 0.4, 0.999, 2.0, 5.0, 20},
      {"almost all backwards", 0.4, -0.99, 2.0, 5.0, 100},
      {"chalk inside", 0.4, 0.6, 2.0, 100.0, 30},
      {"glass on chalk", 0.4, 0.0, 0.0, 20.0, 100},
      {"a film of 1 micrometre", 0.001, 0.6, 2.0, 5.0, 100},
      {"layers that coincide", 0.0, 0.6, 2.0, 5.0, 100},
  };
  for (const Case& c : cases) {
    KnownScene scene(Sphere(1.5, 12), 2, c.thickness_mm, 6, 1.8);
    SetLayer(scene, 0, 1.62, c.outer_g, c.outer_scattering, 0.0);
    SetLayer(scene, 1, 1.54, 0.6, c.inner_scattering, 0.0);
    if (c.thickness_mm == 0) scene.source.meshes[1] = scene.source.meshes[0];
    SetSurface(scene, 0.0, 0.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
    const Mean mean = RenderedMean(scene, c.paths);
    EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-3) << c.name;
  }
}

TEST(WhiteFurnace, LongTotalInternalReflectionIsUnbiased) {
  // A clear cube around a scattering ball: some of what leaves the ball is totally reflected by all six sides until it
  // meets the ball again, up to thousands of times.
  KnownScene scene(Box({-1, -1, -1}, {1, 1, 1}), 2, 0.5, 6, 1.2);
  scene.source.meshes[1] = Sphere(0.6, 12);
  SetLayer(scene, 0, 1.62, 0.0, 0.0, 0.0);
  SetLayer(scene, 1, 1.62, 0.0, 5.0, 0.0);
  SetSurface(scene, 0.0, 0.0);
  scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
  const Mean mean = RenderedMean(scene, 200);
  EXPECT_NEAR(mean.value(), 1.0, 4 * mean.stated + 1e-3);
}

TEST(WhiteFurnace, WhiteSceneryAndBackingDisappear) {
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

/// The mesh, closed as if read from a file.
TriangleMesh Closed(const TriangleMesh& mesh) {
  const TemporaryFolder folder;
  std::vector<std::string> messages;
  WritePly(folder.path / "m.ply", mesh);
  return ReadClosedSurface(folder.path / "m.ply", messages);
}

TEST(WhiteFurnace, OpenScansAndProtrudingLayersDisappear) {
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

TEST(Path, OrderOfOverlappingLayersOfOneMaterialDoesNotMatter) {
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

TEST(Path, RootNeckLiesBetweenAirAndAbsorbingNeck) {
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

TEST(Path, WhiteTileFollowsTheDocumentedRadiometry) {
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
    for (const PixelEstimate& p : photo.pixels) mean.Add(p.mean[1]), variance += p.covariance[3];
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

TEST(Path, DiscOnATileMatchesTheBackedSlabReflectance) {
  // The disc is so wide that no light leaves at its rim; it lies under a dome of radiance 1/pi. By reciprocity, a pixel
  // seen along the normal is the collimated reflectance, surface included.
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
  // No scattering: light from a lamp behind passes a clear plate to the camera, with every internal reflection.
  KnownScene scene(Box({-30, -30, -2}, {30, 30, 0}), 1, 2.0, 2, 0.2);
  SetLayer(scene, 0, 1.5, 0.0, 0.0, 0.2);
  SetSurface(scene, 0.0, 0.0);
  scene.Light(DirectionalLight{{0, 0, -1}, glm::dvec3(1.0), 0.2});
  const double radiance = 1.0 / (kPi * std::pow(std::sin(0.2), 2)), f = 0.04, a = std::exp(-0.4);
  const Mean mean = RenderedMean(scene, 40000);
  EXPECT_NEAR(mean.value(), kPi * radiance * (1 - f) * (1 - f) * a / (1 - f * f * a * a), 4 * mean.stated);
}

}  // namespace
}  // namespace crownfit
