// The shader model as a whole: energy, limits, reciprocity of scale, derivatives.

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "geometry/mesh_file.h"
#include "shader/predict.h"
#include "support/known_scene.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;

CastState StateOf(const KnownScene& scene, const CastOptions& options = {}) {
  CastState state;
  state.thickness_mm = StatedThicknesses(scene.capture);
  state.crown = scene.Build();
  state.photographs.push_back(scene.Cast(*state.crown, options));
  return state;
}

double CentrePixel(const KnownScene& scene, const CastState& state, const Material& material) {
  const auto values = PredictPixels(scene.capture, state, 0, material, StatedLightScales(scene.capture), 0);
  const int middle = scene.capture.photographs[0].camera.width / 2;
  for (size_t i = 0; i < values.size(); ++i)
    if (state.photographs[0].pixels[i].x == middle && state.photographs[0].pixels[i].y == middle) return values[i][1];
  return std::nan("");
}

void Set(Material& m, size_t layer, Quantity q, double v) { m.layers[layer][q].fill(v); }

TEST(Furnace, WhiteSlabDisappearsDryAndWet) {
  // Lit from everywhere by radiance 1/pi, a slab without absorption shows pixel 1, up to the energy that single
  // scattering on facets loses (below 1 % at roughness 0.15) and the three bands of incidence (0.3 %).
  for (double thickness : {0.3, 1.0, 3.0}) {
    KnownScene scene(Disc(thickness, 12.0), 1, 0.5, 8, 2.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
    CastOptions options;
    options.strata = 8;
    const CastState state = StateOf(scene, options);
    Material white = StatedMaterial(scene.capture);
    Set(white, 0, Quantity::kAbsorption, 0.0);
    for (double wetness : {0.0, 0.4, 1.0}) {  // a film of water is not seen either
      white.surface[Quantity::kWetness].fill(wetness);
      EXPECT_NEAR(CentrePixel(scene, state, white), 1.0, 0.02) << thickness << " " << wetness;
    }
  }
}

TEST(Meshes, FinerFaceWithCornersOnItsNeighboursEdgesChangesNoPixel) {
  // The same box, whole: all of its faces as fine as the finer one.
  const auto picture = [](int cells, int top_cells) {
    const TemporaryFolder folder;
    WritePly(folder.path / "m.ply", GridBox({-4, -4, -3}, {4, 4, 3}, cells, top_cells));
    std::vector<std::string> messages;
    KnownScene scene(ReadClosedSurface(folder.path / "m.ply", messages), 1, 0.5, 24, 12.0);
    scene.Light(RectangleLight{{60, 40, 150}, {30, 0, 0}, {0, -30, 0}, glm::dvec3(2.0)});
    scene.Light(DomeLight{glm::dvec3(0.1)});
    const CastState state = StateOf(scene);
    const auto values =
        PredictPixels(scene.capture, state, 0, StatedMaterial(scene.capture), StatedLightScales(scene.capture), 0);
    std::vector<double> green;
    for (const Spectrum& v : values) green.push_back(v[1]);
    return green;
  };
  const std::vector<double> whole = picture(16, 16), cracked = picture(8, 16);
  ASSERT_EQ(whole.size(), cracked.size());
  ASSERT_GT(whole.size(), 200u);
  double sum = 0, sum_cracked = 0;
  for (size_t i = 0; i < whole.size(); ++i) {
    sum += whole[i], sum_cracked += cracked[i];
    EXPECT_NEAR(cracked[i], whole[i], 0.02 * whole[i]) << i;
  }
  EXPECT_NEAR(sum_cracked, sum, 0.003 * sum);
}

TEST(Furnace, AClearOuterLayerChangesNothingButItsBoundary) {
  KnownScene scene(Disc(3.0, 12.0), 2, 0.5, 8, 2.0);
  scene.Light(DomeLight{glm::dvec3(1.0 / kPi)});
  CastOptions options;
  options.strata = 8;
  const CastState state = StateOf(scene, options);
  Material white = StatedMaterial(scene.capture);
  for (size_t l : {0u, 1u}) Set(white, l, Quantity::kAbsorption, 0.0);
  Set(white, 0, Quantity::kReducedScattering, 0.0);
  EXPECT_NEAR(CentrePixel(scene, state, white), 1.0, 0.02);
}

TEST(Limits, AbsorptionDarkensAndHidesTheInnerLayer) {
  KnownScene scene(Disc(3.0, 12.0), 2, 0.5, 8, 2.0);
  scene.Light(DirectionalLight{{0.3, 0, 1}, glm::dvec3(1.0), 0.02});
  scene.capture.photographs[0].polarisation = Polarisation::kCross;
  const CastState state = StateOf(scene);
  Material m = StatedMaterial(scene.capture);
  double before = 1.0;
  for (double a : {0.0, 0.01, 0.1, 1.0, 20.0}) {
    Set(m, 1, Quantity::kAbsorption, a);
    const double now = CentrePixel(scene, state, m);
    EXPECT_LT(now, before);
    EXPECT_GE(now, 0.0);
    before = now;
  }
  Set(m, 0, Quantity::kAbsorption, 20.0);
  Set(m, 0, Quantity::kReducedScattering, 1e-3);
  EXPECT_LT(CentrePixel(scene, state, m), 1e-4);
}

TEST(Limits, FilmReflectsByFresnelAndHidesTheRoughHighlight) {
  // A lamp of radiance 1 straight behind the camera: the film mirrors ((1.333 - 1) / (1.333 + 1))^2 = 2.04 % of it.
  KnownScene scene(Disc(3.0, 12.0), 1, 0.5, 8, 2.0);
  scene.Light(DiskLight{{0, 0, 300}, {0, 0, -1}, glm::dvec3(1.0), 0.0, 20.0});
  const CastState with_gloss = StateOf(scene);
  const auto gloss = [&](double wetness) {
    Material m = StatedMaterial(scene.capture);
    m.surface[Quantity::kRoughness].fill(0.3);
    m.surface[Quantity::kWetness].fill(wetness);
    double values[2];
    for (int i = 0; i < 2; ++i) {
      scene.capture.photographs[0].polarisation = i == 0 ? Polarisation::kNone : Polarisation::kCross;
      values[i] = CentrePixel(scene, with_gloss, m);
    }
    return values[0] - values[1];
  };
  const double film = std::pow(0.333 / 2.333, 2), below = std::pow((1.54 - 1.333) / (1.54 + 1.333), 2),
               dry = std::pow(0.54 / 2.54, 2);
  // Under the film the lobe scales with its own index step; light and view have both passed the film.
  const double rough_below = gloss(0.0) * below / dry * std::pow(1 - film, 2);
  EXPECT_NEAR(gloss(1.0), kPi * film + rough_below / std::pow(1.333, 2), 0.05 * gloss(1.0));
  EXPECT_NEAR(gloss(0.25), 0.75 * gloss(0.0) + 0.25 * gloss(1.0), 1e-6);
}

TEST(Limits, PolarisersRemoveOrDoubleOnlySurfaceReflection) {
  // A lamp in the mirror direction: the surface reflection is large.
  KnownScene scene(Disc(3.0, 12.0), 1, 0.5, 8, 2.0);
  scene.Light(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), 0.1});
  double values[3];
  for (int i = 0; i < 3; ++i) {
    scene.capture.photographs[0].polarisation =
        std::array{Polarisation::kCross, Polarisation::kNone, Polarisation::kParallel}[i];
    values[i] = CentrePixel(scene, StateOf(scene), StatedMaterial(scene.capture));
  }
  EXPECT_GT(values[1], values[0] + 0.1);
  EXPECT_NEAR(values[2] - values[1], values[1] - values[0], 1e-9);
}

TEST(Limits, PolarisersSplitFirstOrderLightByItsMemory) {
  KnownScene scene(Disc(3.0, 12.0), 2, 0.5, 8, 2.0);
  scene.Light(DirectionalLight{{0.3, 0, 1}, glm::dvec3(1.0), 0.02});
  const Material m = StatedMaterial(scene.capture);
  const CastState state = StateOf(scene);
  const auto value = [&](Polarisation filter, double memory_events) {
    scene.capture.photographs[0].polarisation = filter;
    scene.capture.photographs[0].polarisation_memory_events = memory_events;
    return CentrePixel(scene, state, m);
  };
  const double none = value(Polarisation::kNone, 0.0), crossed = value(Polarisation::kCross, 0.0),
               doubled = value(Polarisation::kParallel, 0.0);
  EXPECT_EQ(value(Polarisation::kNone, 5.0), none);
  const double less = crossed - value(Polarisation::kCross, 5.0), all = crossed - value(Polarisation::kCross, 1e6);
  EXPECT_NEAR(value(Polarisation::kParallel, 5.0) - doubled, less, 1e-9);
  EXPECT_NEAR(less / all, std::exp(-1.0 / (5.0 * (1.0 - m.layers[0][Quantity::kAsymmetry][0]))), 1e-3);
  EXPECT_GT(all, 0.01 * none);
}

TEST(Scale, PixelsAreInvariantToLengthScale) {
  // Exact for flat, evenly lit objects (no length scale): the degeneracy of every such measurement.
  const auto pixel = [](double scale) {
    KnownScene scene(Disc(1.0 * scale, 14.0 * scale), 1, 0.5, 8, 2.0);
    scene.Light(DirectionalLight{{0.3, 0, 1}, glm::dvec3(1.0), 0.02});
    scene.capture.photographs[0].polarisation = Polarisation::kCross;
    Material m = StatedMaterial(scene.capture);
    Set(m, 0, Quantity::kReducedScattering, 2.0 / scale);
    Set(m, 0, Quantity::kAbsorption, 0.05 / scale);
    return CentrePixel(scene, StateOf(scene), m);
  };
  EXPECT_NEAR(pixel(2.0), pixel(1.0), 2e-3 * pixel(1.0));
}

TEST(Thickness, ScaledLengthsMatchNewCastsForSmallChanges) {
  const auto pixel = [](double cast_mm, double thickness_mm) {
    KnownScene scene(Sphere(4.0, 48), 2, cast_mm, 8, 2.0);
    scene.Light(DirectionalLight{{0.3, 0, 1}, glm::dvec3(1.0), 0.02});
    scene.capture.photographs[0].polarisation = Polarisation::kCross;
    const CastState state = StateOf(scene);
    Material m = StatedMaterial(scene.capture);
    Set(m, 0, Quantity::kThickness, thickness_mm);
    Set(m, 0, Quantity::kReducedScattering, 0.3);
    return CentrePixel(scene, state, m);
  };
  const double cast_anew = pixel(0.88, 0.88);
  EXPECT_NEAR(pixel(0.8, 0.88), cast_anew, 2e-3 * cast_anew);
  EXPECT_GT(std::abs(pixel(0.8, 0.8) - cast_anew), 4e-3 * cast_anew);  // and the change itself is visible
}

TEST(Derivatives, CurvedLayeredObjectMatchesFiniteDifferences) {
  KnownScene scene(Sphere(4.0, 32), 2, 0.6, 12, 9.0);
  scene.Light(RectangleLight{{120, 0, 120}, {0, 40, 0}, {28, 0, -28}, glm::dvec3(4.0)});
  scene.Light(DiskLight{{0, 0, -140}, {0, 0, 1}, glm::dvec3(4.0), 0.0, 50.0});
  const CastState state = StateOf(scene);
  const PhotographCast& cast = state.photographs[0];
  const std::vector<double> lights = StatedLightScales(scene.capture);
  std::vector<int> vertices(state.crown->fine.vertices.size());
  std::iota(vertices.begin(), vertices.end(), 0);
  using Jet = ceres::Jet<double, kShaderSlots>;
  constexpr std::array<double, kShaderSlots> at{0.3, 0.02, 1.05, 1.63, 2.0, 0.07, 1.0, 1.54, 0.9, 0.25, 0.3, 1.0, 0.68};
  static_assert(at.back() != 0, "every slot needs a value");
  std::array<Jet, kShaderSlots> jets;
  for (int i = 0; i < kShaderSlots; ++i) jets[i] = Jet(at[i], i);
  const auto jet_optics = OpticsFromSlots(scene.capture, jets);
  const DiffuserTable<Jet> jet_table(jet_optics.stack(), state.crown->kernel.outer_radius_mm);
  const ShaderPrediction<Jet> with_derivatives(*state.crown, cast, jet_optics, jet_table, 1, lights, vertices, 0);
  const Polarisers polarisers{2.0, 3.0};
  const auto value = [&](std::array<double, kShaderSlots> slots, const PixelCast& pixel) {
    const auto optics = OpticsFromSlots(scene.capture, slots);
    const DiffuserTable<double> table(optics.stack(), state.crown->kernel.outer_radius_mm);
    return ShaderPrediction<double>(*state.crown, cast, optics, table, 1, lights, vertices, 0).Pixel(pixel, polarisers);
  };
  for (size_t p = 0; p < cast.pixels.size(); p += 17) {
    const Jet pixel = with_derivatives.Pixel(cast.pixels[p], polarisers);
    for (int i = 0; i < kShaderSlots; ++i) {
      const double h = 1e-4 * at[i];
      auto up = at, down = at;
      up[i] += h;
      down[i] -= h;
      const double slope = (value(up, cast.pixels[p]) - value(down, cast.pixels[p])) / (2 * h);
      EXPECT_NEAR(pixel.v[i], slope, 1e-5 * (pixel.a + std::abs(slope))) << "slot " << i << " pixel " << p;
    }
  }
}

/// A long crown along y, seen from its side (+z), whole or scanned down to y = 0 only.
KnownScene LongCrown(bool scanned_in_part) {
  TriangleMesh body = Box({-4, -1.5, -10}, {4, 1.5, 10});  // z is to be y
  if (scanned_in_part) body = OpenBelow(Refined(body, 1.0), 0.0);
  for (auto& v : body.vertices) v = {v.x, v.z, -v.y};
  if (scanned_in_part) {
    const TemporaryFolder folder;
    WritePly(folder.path / "open.ply", body);
    std::vector<std::string> messages;
    body = ReadClosedSurface(folder.path / "open.ply", messages);
  }
  KnownScene scene(body, 1, 0.5, 16, 2.0);
  scene.Light(DirectionalLight{{0.3, 0, 1}, glm::dvec3(1.0), 0.02});
  scene.capture.photographs[0].polarisation = Polarisation::kCross;
  scene.capture.photographs[0].camera_from_object.translation_mm +=
      glm::dvec3(0, 1.2, 0);  // 0.2 to 2.2 mm above the cut
  return scene;
}

TEST(Neck, FullyReturningRootEqualsAContinuedTooth) {
  const KnownScene whole = LongCrown(false), part = LongCrown(true);
  const CastState state = StateOf(part);
  ASSERT_FALSE(state.crown->cut.triangles.empty());
  Material m = StatedMaterial(part.capture);
  Set(m, 0, Quantity::kReducedScattering, 2.0);
  const double all = CentrePixel(whole, StateOf(whole), m);
  EXPECT_NEAR(CentrePixel(part, state, m), all, 0.01 * all);
  m.surface[Quantity::kNeckReturn].fill(0.0);
  EXPECT_LT(CentrePixel(part, state, m), 0.97 * all);
}

TEST(Shadow, ScatteringBlursTheShadowEdge) {
  // Half of a wide slab lies in the shadow of a sheet. The light that reaches 1.9 mm into the shadow came through the
  // material: more of it the farther light travels.
  const auto dark_share = [](double scattering) {
    KnownScene scene(Disc(4.0, 14.0), 1, 0.5, 32, 8.0);
    scene.Light(DirectionalLight{{0, 0, 1}, glm::dvec3(1.0), 2e-4});
    scene.capture.photographs[0].polarisation = Polarisation::kCross;
    scene.capture.scenery.push_back({"sheet", "", glm::dvec3(0.0)});
    scene.scenery.push_back(Box({-40, -40, 400}, {0, 40, 400.1}));
    scene.capture.photographs[0].scenery = {0};
    CastOptions options;
    const CastState state = StateOf(scene, options);
    Material m = StatedMaterial(scene.capture);
    Set(m, 0, Quantity::kReducedScattering, scattering);
    Set(m, 0, Quantity::kAbsorption, 0.02);
    const auto values = PredictPixels(scene.capture, state, 0, m, StatedLightScales(scene.capture), 0);
    double dark = 0, lit = 0;
    for (size_t i = 0; i < values.size(); ++i) {
      const PixelCast& p = state.photographs[0].pixels[i];
      if (p.x == 8) dark += values[i][1];  // 1.9 mm into the shadow
      if (p.x == 31) lit += values[i][1];
    }
    return dark / lit;
  };
  EXPECT_GT(dark_share(1.0), 1.5 * dark_share(4.0));
  EXPECT_GT(dark_share(4.0), 1e-3);
}

}  // namespace
}  // namespace crownfit
