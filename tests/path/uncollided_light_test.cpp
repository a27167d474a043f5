// Walks that find the lamps at every collision see the same picture as walks that meet the lamps when they leave, and
// state their noise, that of the light in its cells included.

#include "path/uncollided_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>

#include "support/channels.h"
#include "support/lit_plate.h"
#include "support/walked.h"

namespace crownfit {
namespace {

PathPhotograph Render(const KnownScene& scene, const LayeredBody& body, Estimator estimator, PathOptions options) {
  options.estimator = estimator;
  options.keeps_groups = true;
  return RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0, options, [](double) {});
}

/// The green sum over all pixels, of every group of paths: independent estimates.
Mean TotalOf(const PathPhotograph& photo) {
  Mean total;
  for (size_t g = 0; g < photo.groups; ++g) {
    double sum = 0;
    for (size_t p = 0; p < photo.pixels.size(); ++p) sum += photo.group_values.at(p * photo.groups + g, 1);
    total.Add(sum);
  }
  return total;
}

struct Case {
  const char* name;
  std::function<KnownScene()> scene;
};

std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }

KnownScene WithIndices(double outer, double inner) {
  KnownScene scene = Plate(0.0);
  scene.capture.layers[0][Quantity::kIor].value.fill(outer);
  scene.capture.layers[1][Quantity::kIor].value.fill(inner);
  return scene;
}

KnownScene OnTile(bool in_contact) {
  KnownScene scene = Plate();
  scene.capture.backings.push_back({"tile", {0, 0, in_contact ? -1.0 : -1.5}, {0, 0, 1}, 10.0, glm::dvec3(0.9)});
  scene.capture.backings[0].in_contact = in_contact;
  scene.capture.photographs[0].backing = 0;
  return scene;
}

const Case kCases[] = {
    {"smooth", [] { return Plate(0.0); }},
    {"rough", [] { return Plate(0.3); }},
    {"wet",
     [] {
       KnownScene scene = Plate();
       SetSurface(scene, 0.3, 0.6);
       return scene;
     }},
    {"ownAsymmetryInEveryLayer",
     [] {
       KnownScene scene = Plate();
       scene.capture.layers[0][Quantity::kAsymmetry].value.fill(0.9);
       scene.capture.layers[1][Quantity::kAsymmetry].value.fill(-0.3);
       return scene;
     }},
    {"absorptionTexture", PlateWithTexture},
    {"rimAlone",
     [] {
       KnownScene scene = Plate();
       LookAtOriginFrom({250, 0, -1}, scene);
       return scene;
     }},
    {"indexStepUp", [] { return WithIndices(1.35, 1.65); }},
    {"indexStepDown", [] { return WithIndices(1.65, 1.35); }},
    {"forward", [] { return Plate(0.2, 0.96); }},
    {"backward", [] { return Plate(0.2, -0.4); }},
    {"backwardSmooth", [] { return Plate(0.0, -0.4); }},
    {"isotropicRough", [] { return Plate(0.2, 0.0); }},
    {"channelsThatScatterDifferently",
     [] {
       KnownScene scene = Plate();
       scene.capture.layers[0][Quantity::kReducedScattering].value = {0.3, 1.0, 3.0};
       return scene;
     }},
    {"tileBehind", [] { return OnTile(false); }},
    {"tileInContact", [] { return OnTile(true); }},
    {"shadowOfScenery",
     [] {
       KnownScene scene = Plate();
       scene.capture.scenery.push_back({"neighbour", "", glm::dvec3(0.8)});
       scene.scenery.push_back(Box({2.2, -2, -1}, {2.6, 2, 1}));
       scene.capture.photographs[0].scenery = {0};
       return scene;
     }},
    {"neckThatReturnsLight",
     [] {
       const TemporaryFolder folder;
       std::vector<std::string> messages;
       WritePly(folder.path / "open.ply", OpenBelow(Sphere(1.5, 12), -0.4));
       KnownScene scene(ReadClosedSurface(folder.path / "open.ply", messages), 1, 0.4, 6, 2.0);
       SetLayer(scene, 0, 1.5, 0.6, 0.3, 0.02);
       SetSurface(scene, 0.2, 0.0);
       scene.Light(DiskLight{{150, 0, 150}, glm::normalize(glm::dvec3(-1, 0, -1)), glm::dvec3(2.0), 0.0, 200.0});
       scene.capture.neck = Neck::kRoot;
       return scene;
     }},
    {"waterOutside",
     [] {
       KnownScene scene = Plate();
       scene.capture.outside_ior = 1.33;
       return scene;
     }},
    {"nearPointLamp",
     [] {
       KnownScene scene = Plate(0.3);
       scene.capture.lights[0].shape = PointLight{{5, 0, 5}, glm::dvec3(20.0), 3.0};
       return scene;
     }},
    {"twoLamps",
     [] {
       KnownScene scene = Plate();
       scene.Light(DiskLight{{-150, 0, 150}, glm::normalize(glm::dvec3(1, 0, -1)), glm::dvec3(1.0), 0.0, 100.0});
       return scene;
     }},
    {"twoLampsForward",
     [] {
       KnownScene scene = Plate(0.0, 0.96);
       scene.Light(DiskLight{{-150, 0, 150}, glm::normalize(glm::dvec3(1, 0, -1)), glm::dvec3(1.0), 0.0, 100.0});
       return scene;
     }},
};

class BothEstimators : public ::testing::TestWithParam<Case> {};

/// Within `tolerance` and 4 standard errors. `hands_over`: to diffusion after three collisions.
void ExpectSamePicture(const KnownScene& scene, int paths, double tolerance, bool hands_over = false) {
  const LayeredBody body = BodyOf(scene);
  std::optional<VolumeLattice> lattice;
  if (hands_over) lattice.emplace(body.surfaces, body.is_exposed, body.absorption, 0.3, 0);
  // One field of diffuse light, whose noise is not stated.
  const auto options_of = [&](int count, uint64_t stream) {
    PathOptions options;
    options.paths_per_pixel = count;
    options.stream = stream;
    options.lattice = lattice ? &*lattice : nullptr;
    options.collisions = 3;
    return options;
  };
  const Mean exits = TotalOf(Render(scene, body, Estimator::kExits, options_of(2 * paths, 1))),
             collisions = TotalOf(Render(scene, body, Estimator::kCollisions, options_of(paths, 2)));
  const double error = std::hypot(exits.error(), collisions.error()) / exits.value();
  EXPECT_NEAR(collisions.value() / exits.value(), 1.0, tolerance + 4 * error);
  EXPECT_LT(error, 0.03) << "the comparison can tell";
  ::testing::Test::RecordProperty("ratio", std::to_string(collisions.value() / exits.value()));
  ::testing::Test::RecordProperty("error", std::to_string(error));
}

TEST_P(BothEstimators, SeeTheSamePicture) { ExpectSamePicture(GetParam().scene(), 1200, 0.002); }
TEST_P(BothEstimators, SeeTheSamePictureWithinAFewTenthsOfAPercent) {
  ExpectSamePicture(GetParam().scene(), 20000, 0.002);
}
TEST_P(BothEstimators, SeeTheSamePictureWhereWalksAreHandedOver) {
  ExpectSamePicture(GetParam().scene(), 1200, 0.002, true);
}
TEST_P(BothEstimators, SeeTheSamePictureWhereWalksAreHandedOverWithinAFewTenthsOfAPercent) {
  ExpectSamePicture(GetParam().scene(), 20000, 0.003, true);
}
INSTANTIATE_TEST_SUITE_P(Scenes, BothEstimators, ::testing::ValuesIn(kCases),
                         [](const auto& of_case) { return of_case.param.name; });

TEST(UncollidedLight, FallsOffAsBeerAndLambertSay) {
  // A plate under a slanted beam: fluence x cosine inside = irradiance x transmittance x exp(-extinction x way).
  constexpr double kIor = 1.5, kExtinction = 4.0;
  KnownScene scene(Box({-1, -1, -1.5}, {3, 1, 0}), 1, 0.4, 4, 1.0);
  SetLayer(scene, 0, kIor, 0.0, 3.0, 1.0);
  SetSurface(scene, 0.0, 0.0);
  const glm::dvec3 towards = glm::normalize(glm::dvec3(1, 0, 1.5));
  scene.Light(DirectionalLight{towards, glm::dvec3(2.0), 0.001});
  const LayeredBody body = BodyOf(scene);
  const WalkScene walks(body, {});
  const Material material = StatedMaterial(scene.capture);
  const Media media = MediaOf(scene.capture, material, body);
  const std::vector<OpaqueThing> things;
  PathOptions options;
  options.estimator = Estimator::kCollisions;
  const PathContext context = PathContextOf(scene.capture, material, {0}, options, {walks, media, things});
  const double outside = towards.z, inside = std::sqrt(1.0 - (1.0 - outside * outside) / (kIor * kIor)),
               s = (outside - kIor * inside) / (outside + kIor * inside),
               p = (kIor * outside - inside) / (kIor * outside + inside),
               passes = 1.0 - 0.5 * (s * s + p * p);  // Fresnel, unpolarised
  for (const double cell_mm : {0.05, 0.08}) {
    const UncollidedLight light(context, media, body, {.rays = 400000, .cell_mm = cell_mm}, 1, 0);
    for (const double depth : {0.02, 0.1, 0.3, 0.6}) {
      const std::vector<float> ones(kChannels, 1.0f);
      std::vector<UncollidedLight::OfGroups> sums(kChannels);
      constexpr int kPlaces = 20;
      for (int i = 0; i < kPlaces * kPlaces; ++i) {
        const glm::dvec2 of_side = (glm::dvec2(i % kPlaces, i / kPlaces) + 0.5) / static_cast<double>(kPlaces);
        const glm::dvec3 at(0.8 * of_side - 0.4, -depth);
        const int layer = 0;
        float x, y, z;
        int part;
        const int32_t* blocks;
        light.Locate(1, &at.x, &at.y, &at.z, &layer, &x, &y, &z, &part);
        if (light.Open(part, blocks) && blocks[0] >= 0)
          light.AddScattered({blocks, {x, y, z}}, 0, {0, 0, -1}, media[1], ones.data(), sums.data());
      }
      const double fluence =
          4 * std::numbers::pi * std::accumulate(sums[0].begin(), sums[0].end(), 0.0) / (kPlaces * kPlaces);
      const double expected = 2.0 * outside * passes / inside * std::exp(-kExtinction * depth / inside);
      EXPECT_NEAR(fluence * kIor * kIor / expected, 1.0, 0.02)
          << depth << " mm deep, cells of " << light.cell_mm() << " mm";
    }
  }
}

TEST(UncollidedLight, CellsHalvedAndDoubledGiveTheSamePicture) {
  const KnownScene scene = Plate();
  const LayeredBody body = BodyOf(scene);
  std::vector<Mean> totals;
  for (const double cell_mm : {0.12, 0.25, 0.5})
    totals.push_back(TotalOf(Render(scene, body, Estimator::kCollisions,
                                    {.paths_per_pixel = 800, .uncollided = {.rays = 100000, .cell_mm = cell_mm}})));
  for (const Mean& total : totals)
    EXPECT_NEAR(total.value() / totals[0].value(), 1.0,
                0.002 + 4 * std::hypot(total.error(), totals[0].error()) / totals[0].value());
}

TEST(UncollidedLight, WalksLookForLampsAtExitsWhereCellsWouldHoldTooManyFreePaths) {
  KnownScene scene(Box({-2, -2, -1}, {2, 2, 0}), 1, 0.3, 2, 1.0);
  scene.Light(DiskLight{{150, 0, 150}, glm::normalize(glm::dvec3(-1, 0, -1)), glm::dvec3(2.0), 0.0, 200.0});
  const auto estimator_at = [&](double reduced_scattering) {
    SetLayer(scene, 0, 1.5, 0.9, reduced_scattering, 10.0);
    return Render(scene, BodyOf(scene), Estimator::kCollisions, {.paths_per_pixel = 4}).estimator;
  };
  EXPECT_EQ(estimator_at(1.0), Estimator::kCollisions);
  EXPECT_EQ(estimator_at(1000.0), Estimator::kExits);
}

TEST(UncollidedLight, StatedErrorsHoldTheNoiseOfItsRays) {
  // Few rays, so that their noise is most of the total's and a part of a pixel's.
  const KnownScene scene = Plate();
  const LayeredBody body = BodyOf(scene);
  constexpr int kSeeds = 30;
  constexpr int kPatches = 4;  // quarters of the picture
  Mean totals, squares_of_errors;
  std::array<Mean, kPatches> patches;
  std::vector<Mean> pixels;
  double stated_of_pixels = 0, stated_of_patches = 0;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const PathPhotograph photo =
        Render(scene, body, Estimator::kCollisions,
               {.paths_per_pixel = 32, .seed = seed, .uncollided = {.rays = 3000, .cell_mm = 0.3}});
    const Mean total = TotalOf(photo);
    totals.Add(total.value());
    squares_of_errors.Add(total.error() * total.error());
    for (size_t k = 0; k < kPatches; ++k) {
      Mean patch;
      for (size_t g = 0; g < photo.groups; ++g) {
        double sum = 0;
        for (size_t p = 0; p < photo.pixels.size(); ++p)
          if (p % photo.width / 3 + 2 * (p / photo.width / 3) == k)
            sum += photo.group_values.at(p * photo.groups + g, 1);
        patch.Add(sum);
      }
      patches[k].Add(patch.value());
      stated_of_patches += patch.error() * patch.error() / kSeeds;
    }
    pixels.resize(photo.pixels.size());
    for (size_t p = 0; p < pixels.size(); ++p) {
      pixels[p].Add(photo.pixels[p].mean[1]);
      stated_of_pixels += photo.pixels[p].variance()[1] / kSeeds;
    }
  }
  const auto variance = [](const Mean& m) { return m.error() * m.error() * m.n; };
  double found_of_patches = 0;
  for (const Mean& patch : patches) found_of_patches += variance(patch);
  double found_of_pixels = 0;
  for (const Mean& pixel : pixels) found_of_pixels += variance(pixel);
  // 30 seeds tell a variance to 26 %; many pixels tell their pooled one to a few per cent.
  EXPECT_NEAR(squares_of_errors.value() / variance(totals), 1.0, 0.6);
  EXPECT_NEAR(stated_of_patches / found_of_patches, 1.0, 0.4);
  EXPECT_NEAR(stated_of_pixels / found_of_pixels, 1.0, 0.15);
}

}  // namespace
}  // namespace crownfit
