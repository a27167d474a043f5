// Walks that find the lamps at every collision against what must hold: a lossless object in uniform light, lamp and
// camera exchanged, and flat slabs by adding-doubling.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "optics/adding_doubling.h"
#include "support/shapes.h"
#include "support/slabs.h"
#include "support/walked.h"

namespace crownfit {
namespace {

/// The green mean over all pixels; groups of paths hold all noise.
Mean Seen(const KnownScene& scene, int paths, uint64_t seed = 1, int rays = 0) {
  PathOptions options;
  options.paths_per_pixel = paths;
  options.seed = seed;
  options.estimator = Estimator::kCollisions;
  options.uncollided.rays = rays;
  options.keeps_groups = true;
  const LayeredBody body = BodyOf(scene);
  const PathPhotograph photo =
      RenderByPaths(scene.capture, body, scene.scenery, StatedMaterial(scene.capture), 0, options, [](double) {});
  Mean mean;
  for (size_t g = 0; g < photo.groups; ++g) {
    double sum = 0;
    for (size_t p = 0; p < photo.pixels.size(); ++p) sum += photo.group_values.at(p * photo.groups + g, 1);
    mean.Add(sum / static_cast<double>(photo.pixels.size()));
  }
  return mean;
}

/// Lamps of radiance 1 on the walls of a room of this half width, from z = `floor` up; with a lamp on the floor too.
void LightFromWalls(KnownScene& scene, double half_mm, double floor_mm, bool has_floor) {
  const double high = 0.5 * (half_mm - floor_mm), middle = 0.5 * (half_mm + floor_mm);
  const glm::dvec3 one(1.0), up(0, 0, high);
  for (const double side : {-1.0, 1.0}) {
    scene.Light(RectangleLight{{side * half_mm, 0, middle}, {0, half_mm, 0}, -side * up, one});
    scene.Light(RectangleLight{{0, side * half_mm, middle}, -side * up, {half_mm, 0, 0}, one});
  }
  scene.Light(RectangleLight{{0, 0, half_mm}, {0, half_mm, 0}, {half_mm, 0, 0}, one});
  if (has_floor) scene.Light(RectangleLight{{0, 0, floor_mm}, {half_mm, 0, 0}, {0, half_mm, 0}, one});
}

TEST(LightAtCollisions, LosslessObjectInUniformLightVanishes) {
  for (const double roughness : {0.0, 0.3}) {
    KnownScene scene(Sphere(2.0, 24), 2, 0.4, 6, 2.0);
    SetLayer(scene, 0, 1.6, 0.7, 1.0, 0.0);
    SetLayer(scene, 1, 1.4, -0.3, 2.0, 0.0);
    SetSurface(scene, roughness, 0.0);
    LightFromWalls(scene, 60.0, -60.0, true);
    const Mean seen = Seen(scene, 400, 1, 200000);
    EXPECT_NEAR(seen.value() / std::numbers::pi, 1.0, 0.002 + 4 * seen.error() / std::numbers::pi) << roughness;
    EXPECT_LT(seen.error(), 0.01 * std::numbers::pi) << "the test can tell";
  }
}

TEST(LightAtCollisions, IsReciprocalInSmallLampAndCamera) {
  // A lamp of a quarter of a degree, which walks that leave a smooth surface hardly ever meet.
  const auto look = [](double roughness, const glm::dvec3& lamp, bool swap, uint64_t seed) {
    KnownScene scene(Box({-1.5, -1.5, -1}, {1.5, 1.5, 0}), 2, 0.3, 8, 6.0);
    SetLayer(scene, 0, 1.62, 0.6, 1.0, 0.02);
    SetLayer(scene, 1, 1.45, 0.8, 2.0, 0.1);
    SetSurface(scene, roughness, 0.0);
    scene.capture.photographs[0].polarisation = Polarisation::kCross;  // without highlights
    if (swap) LookAtOriginFrom(lamp, scene);
    const glm::dvec3 place = swap ? glm::dvec3(0, 0, 250) : lamp;
    scene.Light(DiskLight{place, -glm::normalize(place), glm::dvec3(1e4), 0.0, 1.0});
    return Seen(scene, 2000, seed);
  };
  const glm::dvec3 lamp = 250.0 * Towards(0.9, 0.7);
  for (const double roughness : {0.0, 0.3}) {
    const Mean there = look(roughness, lamp, false, 1), back = look(roughness, lamp, true, 2);
    EXPECT_NEAR(back.value() / there.value(), 1.0, 0.002 + 4 * std::hypot(there.error(), back.error()) / there.value())
        << roughness;
    EXPECT_LT(there.error(), 0.01 * there.value()) << "the test can tell";
  }
}

TEST(LightAtCollisions, WideSlabReturnsWhatAddingDoublingSays) {
  // By reciprocity, the radiance along the normal under uniform light is the reflectance for light along the normal.
  const Slab slabs[] = {
      Of({Tissue(.05, 15, .8, 1.54, 1)}),
      Of({Tissue(.02, 6.25, .68, 1.63, .3), Tissue(.1, 20, .9, 1.54, .4), Tissue(.02, 6.25, .68, 1.63, .3)})};
  for (const Slab& slab : slabs) {
    const int layers = slab.layers.size() > 1 ? 2 : 1;  // the second lies inside the first
    KnownScene scene(Box({-7, -7, -1}, {7, 7, 0}), layers, slab.layers[0].thickness_mm, 4, 3.0);
    for (int l = 0; l < layers; ++l) {
      const SlabLayer& layer = slab.layers[static_cast<size_t>(l)];
      SetLayer(scene, static_cast<size_t>(l), layer.ior, layer.g, layer.scattering_per_mm * (1.0 - layer.g),
               layer.absorption_per_mm);
    }
    SetSurface(scene, 0.0, 0.0);
    scene.capture.photographs[0].polarisation = Polarisation::kCross;  // without what the surface reflects
    LightFromWalls(scene, 100.0, 0.0, false);
    const Mean seen = Seen(scene, 4000, 1, 200000);
    const double want = SolveByAddingDoubling(slab).value.reflectance_collimated;
    EXPECT_NEAR(seen.value() / std::numbers::pi, want, 0.003 * want + 4 * seen.error() / std::numbers::pi) << layers;
    EXPECT_LT(seen.error() / std::numbers::pi, 0.01 * want) << "the test can tell";
  }
}

}  // namespace
}  // namespace crownfit
