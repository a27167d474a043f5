// Radiometry by hand: a white Lambertian tile under one light of each kind (the contract's list, docs/file_formats.md).

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "geometry/light_samples.h"
#include "support/known_scene.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

/// Mean pixel of a white tile at the origin facing +z, seen from above; the object itself is out of the way.
double WhiteTile(const LightShape& light, int strata = 8) {
  TriangleMesh object = Box({-0.1, -0.1, -60.2}, {0.1, 0.1, -60});
  KnownScene scene(object, 1, 0.5, 4, 2.0);
  scene.capture.scenery.push_back({"tile", "", glm::dvec3(1.0)});
  scene.scenery.push_back(SquareTile(glm::dvec3(0.0), {0, 0, 1}, 20));
  scene.capture.photographs[0].scenery = {0};
  scene.Light(light);
  CastOptions options;
  options.shade_scenery = true;
  options.strata = strata;
  const PhotographCast cast = scene.Cast(*scene.Build(), options);
  EXPECT_EQ(cast.background.size(), 16u);
  double sum = 0;
  for (const auto& pixel : cast.background) sum += pixel.value.y / static_cast<double>(cast.background.size());
  return sum;
}

TEST(Radiometry, DirectionalLightOfIrradianceOneGivesPixelOneAndHalfAtSixtyDegrees) {
  const double degree = kPi / 180;
  EXPECT_NEAR(WhiteTile(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), degree}), 1.0, 1e-4);
  EXPECT_NEAR(WhiteTile(DirectionalLight{{std::sin(60 * degree), 0, 0.5}, glm::dvec3(1.0), degree}), 0.5, 1e-3);
}

TEST(Radiometry, PointLightAt250MillimetresOfIntensity62500GivesOne) {
  EXPECT_NEAR(WhiteTile(PointLight{{0, 0, 250}, glm::dvec3(62500.0), 250 * kPi / 180}), 1.0, 1e-3);
}

TEST(Radiometry, DomeOfRadianceOneOverPiGivesOne) {
  EXPECT_NEAR(WhiteTile(DomeLight{glm::dvec3(1.0 / kPi)}), 1.0, 1e-6);
}

TEST(Radiometry, DiskAndRingOnAxisFollowTheConeFormula) {
  // E = pi L sin^2 of the half angle, and the difference of two for a ring.
  const double outer = 40.0 * 40.0 / (40.0 * 40.0 + 100.0 * 100.0), inner = 20.0 * 20.0 / (20.0 * 20.0 + 100.0 * 100.0);
  EXPECT_NEAR(WhiteTile(DiskLight{{0, 0, 100}, {0, 0, -1}, glm::dvec3(2.0), 0.0, 40.0}), 2 * kPi * outer, 5e-3);
  EXPECT_NEAR(WhiteTile(DiskLight{{0, 0, 100}, {0, 0, -1}, glm::dvec3(2.0), 20.0, 40.0}), 2 * kPi * (outer - inner),
              5e-3);
}

TEST(Radiometry, RectangleFollowsLambertsPolygonFormula) {
  // Form factor of a rectangle seen from below its centre (Howell C-11, four corners).
  const double a = 30.0 / 100.0, b = 20.0 / 100.0;
  const double corner = (a / std::sqrt(1 + a * a) * std::atan(b / std::sqrt(1 + a * a)) +
                         b / std::sqrt(1 + b * b) * std::atan(a / std::sqrt(1 + b * b))) /
                        (2 * kPi);
  EXPECT_NEAR(WhiteTile(RectangleLight{{0, 0, 100}, {0, 20, 0}, {30, 0, 0}, glm::dvec3(1.5)}), 1.5 * kPi * 4 * corner,
              5e-3);
}

TEST(Radiometry, AreaLightsShineToOneSideOnly) {
  EXPECT_EQ(WhiteTile(DiskLight{{0, 0, 100}, {0, 0, 1}, glm::dvec3(2.0), 0.0, 40.0}), 0.0);
  EXPECT_EQ(WhiteTile(RectangleLight{{0, 0, 100}, {30, 0, 0}, {0, 20, 0}, glm::dvec3(1.5)}), 0.0);
}

TEST(Radiometry, GlossSamplesOfADomeIntegrateIrradianceAndTheLobeAlike) {
  std::vector<LightSample> samples;
  const glm::dvec3 normal(0, 0, 1), view = glm::normalize(glm::dvec3(0.4, 0, 1));
  double irradiance = 0;
  SampleDomeForGloss(DomeLight{glm::dvec3(1.0 / kPi)}, normal, view, 0.15, 64, samples);
  for (const auto& s : samples) irradiance += s.weight.x * glm::dot(s.direction, normal);
  EXPECT_NEAR(irradiance, 1.0, 0.01);  // directions below cosine 1e-4 and the strata's size
}

}  // namespace
}  // namespace crownfit
