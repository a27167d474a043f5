// Radiometry by hand: a white Lambertian tile under one light of each kind (the contract's list, docs/file_formats.md).

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "optics/shading_terms.h"
#include "scene/cast_samples.h"
#include "scene/light_samples.h"
#include "support/known_scene.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

/// Mean pixel of a white tile at the origin facing +z, seen from above; the object itself is out of the way.
double WhiteTile(const LightShape& light, int strata = 8, double intensity_scale = 1.0) {
  TriangleMesh object = Box({-0.1, -0.1, -60.2}, {0.1, 0.1, -60});
  KnownScene scene(object, 1, 0.5, 4, 2.0);
  scene.capture.scenery.push_back({"tile", "", glm::dvec3(1.0)});
  scene.scenery.push_back(SquareTile(glm::dvec3(0.0), {0, 0, 1}, 20));
  scene.capture.photographs[0].scenery = {0};
  scene.Light(light);
  scene.capture.lights[0].intensity_scale = intensity_scale;
  CastOptions options;
  options.shade_scenery = true;
  options.strata = strata;
  const PhotographCast cast = scene.Cast(*scene.Build(), options);
  EXPECT_EQ(cast.background.size(), 16u);
  double sum = 0;
  for (const auto& pixel : cast.background) sum += pixel.value[1] / static_cast<double>(cast.background.size());
  return sum;
}

TEST(Radiometry, DirectionalLightGivesOneAndHalfAtSixtyDegrees) {
  const double degree = kPi / 180;
  EXPECT_NEAR(WhiteTile(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), degree}), 1.0, 1e-4);
  EXPECT_NEAR(WhiteTile(DirectionalLight{{std::sin(60 * degree), 0, 0.5}, glm::dvec3(1.0), degree}), 0.5, 1e-3);
}

TEST(Radiometry, TileBrightnessIsProportionalToIntensity) {
  EXPECT_NEAR(WhiteTile(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), 0.01}, 8, 2.0), 2.0, 2e-4);
}

TEST(Radiometry, PointLightAt250MillimetresOfIntensity62500GivesOne) {
  EXPECT_NEAR(WhiteTile(PointLight{{0, 0, 250}, glm::dvec3(62500.0), 250 * kPi / 180}), 1.0, 1e-3);
}

TEST(Radiometry, DomeOfRadianceOneOverPiGivesOne) {
  EXPECT_NEAR(WhiteTile(DomeLight{glm::dvec3(1.0 / kPi)}), 1.0, 1e-6);
}

/// A grey panorama with this radiance in each pixel.
EnvironmentLight Panorama(int height, const std::function<float(int x, int y)>& radiance) {
  Image picture(2 * height, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < 2 * height; ++x)
      for (int c = 0; c < 3; ++c) picture.values[3 * (static_cast<size_t>(y) * 2 * height + x) + c] = radiance(x, y);
  return {std::make_shared<EnvironmentMap>(std::move(picture)), glm::dvec3(1.0)};
}

TEST(Radiometry, EnvironmentOfOneColourIsADome) {
  const auto uniform = Panorama(16, [](int, int) { return static_cast<float>(1.0 / kPi); });
  EXPECT_NEAR(WhiteTile(uniform, 32), 1.0, 2e-3);
}

TEST(Radiometry, EnvironmentFollowsOpenExrOrientation) {
  // The picture's centre along +z, its left quarter along +x, its top along +y.
  const auto lit = [](double u, double v, const glm::dvec3& direction) {
    const auto light =
        Panorama(32, [&](int x, int y) { return std::hypot(x + 0.5 - 64 * u, y + 0.5 - 32 * v) < 3 ? 1.0f : 0.0f; });
    return light.map->Radiance(direction)[0];
  };
  EXPECT_EQ(lit(0.5, 0.5, {0, 0, 1}), 1.0);
  EXPECT_EQ(lit(0.25, 0.5, {1, 0, 0}), 1.0);
  EXPECT_EQ(lit(0.75, 0.5, {-1, 0, 0}), 1.0);
  EXPECT_EQ(lit(0.5, 0.25, glm::normalize(glm::dvec3(0, 1, 1))), 1.0);
  EXPECT_EQ(lit(0.5, 0.5, {0, 0, -1}), 0.0);
}

TEST(Radiometry, EnvironmentTurnsWithItsFrame) {
  const EnvironmentLight light = Panorama(32, [](int x, int y) { return static_cast<float>(x + 100 * y); });
  RigidTransform quarter;  // x to y, y to -x
  quarter.rotation = glm::dmat3(glm::dvec3(0, 1, 0), glm::dvec3(-1, 0, 0), glm::dvec3(0, 0, 1));
  const LightShape turned = Transformed(light, quarter);
  const glm::dvec3 direction = glm::normalize(glm::dvec3(0.3, -0.5, 0.7));
  EXPECT_EQ(LightAlong(turned, glm::dvec3(0.0), quarter.Direction(direction))->radiance[0],
            LightAlong(light, glm::dvec3(0.0), direction)->radiance[0]);
}

TEST(Radiometry, EnvironmentSamplingDensityMatchesItsRadiance) {
  const EnvironmentLight light = Panorama(
      8, [](int x, int y) { return static_cast<float>((x * 7 + y * 3) % 5) + (x == 3 && y == 2 ? 50.f : 0.f); });
  // Solid angle and light by sampling (points without light have density 0) against sums over a fine grid.
  const int n = 256;
  double lit = 0, integral = 0, lit_sampled = 0, integral_sampled = 0;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      const double u = (i + 0.5) / n, v = (j + 0.5) / n, height = 1 - 2 * v, s = std::sqrt(1 - height * height);
      const glm::dvec3 even(s * std::sin(2 * kPi * u), height, s * std::cos(2 * kPi * u));
      const double value = light.map->Radiance(even)[0];
      lit += (value > 0) * 4 * kPi / (n * n);
      integral += value * even.x * even.x * 4 * kPi / (n * n);
      const glm::dvec3 drawn = light.map->Sample({u, v});
      lit_sampled += 1.0 / light.map->Density(drawn) / (n * n);
      integral_sampled += light.map->Radiance(drawn)[0] * drawn.x * drawn.x / light.map->Density(drawn) / (n * n);
    }
  }
  EXPECT_NEAR(lit_sampled / lit, 1.0, 0.02);
  EXPECT_NEAR(integral_sampled / integral, 1.0, 0.02);
}

/// Irradiance of an environment, per channel: by its far lamps, and by a sum over its pixels.
std::pair<Spectrum, Spectrum> CutAndSummed(const EnvironmentMap& map, size_t lamps, const glm::dvec3& normal) {
  Spectrum cut, summed;
  for (const EnvironmentMap::FarLamp& l : map.FarLamps(lamps))
    cut += std::max(0.0, glm::dot(l.direction, normal)) * l.irradiance;
  const int rows = 512;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < 2 * rows; ++i) {
      const double polar = kPi * (j + 0.5) / rows, a = kPi * (i + 0.5) / rows, s = std::sin(polar);
      const glm::dvec3 d(s * std::sin(a), std::cos(polar), s * std::cos(a));
      summed += std::max(0.0, glm::dot(d, normal)) * s * (kPi / rows) * (kPi / rows) * map.Radiance(d);
    }
  return {cut, summed};
}

TEST(Radiometry, FarLampsKeepTheLightOfSmallColouredLamps) {
  // A dim grey room with lamps of one pixel each. A few samples by brightness would give their light to one colour or
  // lose it.
  Image picture(128, 64, 3);
  for (float& v : picture.values) v = 0.02f;
  const int places[5][2] = {{20, 10}, {35, 20}, {64, 5}, {90, 18}, {110, 25}};
  for (int k = 0; k < 5; ++k)
    picture.values[3 * (static_cast<size_t>(places[k][1]) * 128 + places[k][0]) + k % 3] = 100.0f;
  const EnvironmentMap map(std::move(picture));
  for (const glm::dvec3 normal :
       {glm::dvec3(0, 1, 0), glm::normalize(glm::dvec3(0.5, 0.6, -0.4)), glm::dvec3(0, 0, 1)}) {
    const auto [cut, summed] = CutAndSummed(map, 128, normal);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(cut[c] / summed[c], 1.0, 0.02);  // parts that straddle the horizon
  }
}

TEST(Radiometry, FarLampsPreserveTheFirstMomentOfLight) {
  for (const int height : {1, 3, 64, 100}) {
    const EnvironmentLight light =
        Panorama(height, [](int x, int y) { return static_cast<float>(1 + (5 * x + 3 * y) % 7); });
    for (const size_t lamps : {1, 2, 32, 100, 512}) {
      ASSERT_EQ(light.map->FarLamps(lamps).size(), std::bit_floor(lamps));
      // The light's first moment, which any cut keeps.
      glm::dvec3 first(0.0);
      for (const EnvironmentMap::FarLamp& l : light.map->FarLamps(lamps)) first += l.direction * l.irradiance[0];
      glm::dvec3 whole(0.0);
      for (const EnvironmentMap::FarLamp& l : light.map->FarLamps(1)) whole += l.direction * l.irradiance[0];
      EXPECT_NEAR(glm::distance(first, whole), 0.0, 1e-9);
    }
  }
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

TEST(Radiometry, GlossSamplesIntegrateIrradianceAndLobe) {
  const glm::dvec3 normal(0, 0, 1);
  for (const double cos_view : {0.93, 0.3, 0.02})
    for (const double roughness : {0.05, 0.15, 0.6}) {
      std::vector<LightSample> samples;
      const glm::dvec3 view(std::sqrt(1.0 - cos_view * cos_view), 0, cos_view);
      double irradiance = 0, largest = 0;
      constexpr int kStrata = 64;
      SampleAllAroundForGloss(DomeLight{glm::dvec3(1.0 / kPi)}, normal, view, roughness, kStrata, samples);
      for (const auto& s : samples) {
        const glm::dvec3 half = glm::normalize(s.direction + view);
        irradiance += s.weight[0] * glm::dot(s.direction, normal);
        largest = std::max(largest, s.weight[0] * glm::dot(s.direction, normal) *
                                        Terms<double>::SurfaceReflection(s.direction.z, cos_view, half.z,
                                                                         glm::dot(s.direction, half), roughness, 1.5));
      }
      EXPECT_NEAR(irradiance, 1.0, 0.02) << cos_view << " " << roughness;  // below cosine 1e-4, the strata's size
      // No sample weighs more than one of as many of a mirror's.
      EXPECT_LT(largest, 1.01 / kPi / (kStrata * kStrata)) << cos_view << " " << roughness;
    }
}

}  // namespace
}  // namespace crownfit
