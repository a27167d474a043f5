// Model diffusion: its lattice and solver against closed forms, its derivatives against differences, and its pictures
// against the random walk that it stands for.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "path/light_field.h"
#include "support/channels.h"
#include "support/shapes.h"
#include "support/walked.h"

namespace crownfit {
namespace {

VolumeLattice LatticeOver(const LayeredBody& body, double element_mm) {
  return VolumeLattice(body.surfaces, body.is_exposed, body.absorption, element_mm, 0);
}

/// Tooth-like, lit by a softbox; rough, so that the walk finds lamps with little noise.
KnownScene RoughIncisor(int pixels) {
  KnownScene scene = SmoothIncisor(pixels);
  SetSurface(scene, 0.3, 0.0);
  return scene;
}

TEST(VolumeLattice, MatchesTheVolumeAndAreaOfTheBody) {
  const LayeredBody body({Incisor(), Box({-1, -2, -0.5}, {1, 0, 0.5})}, 0);
  const VolumeLattice lattice = LatticeOver(body, 0.3);
  double volume = 0, area = 0;
  for (int i = 0; i < lattice.nodes().count(); ++i) volume += lattice.volume_mm3(i);
  for (const BoundaryPiece& piece : lattice.pieces()) area += piece.area_mm2;
  EXPECT_NEAR(volume / Volume(body.surfaces[0]), 1.0, 4e-3);  // 64 points an element
  EXPECT_NEAR(area / Area(body.surfaces[0]), 1.0, 1e-9);
}

TEST(VolumeLattice, SolvesABallWithARobinBoundary) {
  // -div(D grad psi) = 1 in a ball, D dpsi/dn + leak psi = 0: psi = (R^2 - r^2) / (6 D) + R / (3 leak).
  constexpr double kRadius = 2.0, kConduction = 0.3, kLeak = 0.2;
  const LayeredBody body({Sphere(kRadius, 64)}, 0);
  for (const double element : {0.3, 0.15}) {
    const VolumeLattice lattice = LatticeOver(body, element);
    const std::vector<double> conduction{kConduction}, sink{0.0}, leak(lattice.pieces().size(), kLeak);
    const LatticeSolver solver(lattice.nodes(), lattice.Matrix(conduction, sink, leak, 0));
    std::vector<std::vector<double>> b(1), solved(1);
    for (int i = 0; i < lattice.nodes().count(); ++i) b[0].push_back(lattice.volume_mm3(i));
    solver.Solve(b, solved, 1e-10);
    const std::vector<double>& psi = solved[0];
    for (const double r : {0.0, 1.0, 1.9}) {
      const LatticeStencil s = lattice.StencilOf(*lattice.PlaceOf(r * glm::normalize(glm::dvec3(1, 2, 3))));
      double there = 0;
      for (int k = 0; k < 8; ++k) there += s.weight[k] * psi[s.node[k]];
      const double exact = (kRadius * kRadius - r * r) / (6.0 * kConduction) + kRadius / (3.0 * kLeak);
      EXPECT_NEAR(there / exact, 1.0, 0.005) << element << " mm, at " << r;  // 64 rings: the mesh is 0.2 % small
    }
  }
}

TEST(LatticeSolver, NeedsNoMoreIterationsOnFinerLattices) {
  const KnownScene scene = SmoothIncisor(4);
  const LayeredBody body = BodyOf(scene);
  for (const double element : {0.4, 0.2, 0.1}) {
    const VolumeLattice lattice = LatticeOver(body, element);
    const std::vector<double> conduction{0.42, 0.38}, sink{0.08, 0.24}, leak(lattice.pieces().size(), 0.27);
    const LatticeSolver solver(lattice.nodes(), lattice.Matrix(conduction, sink, leak, 0));
    std::vector<std::vector<double>> b(1, std::vector<double>(lattice.nodes().count(), 0.0)), psi(1);
    for (const BoundaryPiece& piece : lattice.pieces())
      if (piece.normal.z > 0)
        for (int k = 0; k < 8; ++k) b[0][piece.stencil.node[k]] += piece.area_mm2 * piece.stencil.weight[k];
    EXPECT_LE(solver.Solve(b, psi, 1e-6), 10) << element;
  }
}

TEST(LatticeSolver, SimultaneousSolvesMatchSingleSolves) {
  const LayeredBody body({Sphere(2.0, 32)}, 0);
  const VolumeLattice lattice = LatticeOver(body, 0.2);
  const std::vector<double> conduction{0.3}, sink{0.1}, leak(lattice.pieces().size(), 0.2);
  const LatticeSolver solver(lattice.nodes(), lattice.Matrix(conduction, sink, leak, 0));
  std::vector<std::vector<double>> b(7);  // four, two and one together; one of them without any light
  for (size_t k = 0; k < b.size(); ++k)
    for (int i = 0; i < lattice.nodes().count(); ++i)
      b[k].push_back(k == 2 ? 0.0 : lattice.volume_mm3(i) * std::cos(0.01 * static_cast<double>(k) * i));
  std::vector<std::vector<double>> together(b.size());
  solver.Solve(b, together, 1e-10);
  for (size_t k = 0; k < b.size(); ++k) {
    std::vector<std::vector<double>> alone(1);
    solver.Solve(std::span(b).subspan(k, 1), alone, 1e-10);
    for (size_t i = 0; i < alone[0].size(); ++i) ASSERT_NEAR(together[k][i], alone[0][i], 1e-8) << k;
  }
}

KnownScene TwoLayersOverTile() {
  KnownScene scene(Box({-2, -2, -1.2}, {2, 2, 0}), 2, 0.4, 4);
  SetLayer(scene, 0, 1.6, 0.7, 1.2, 0.05);
  SetLayer(scene, 1, 1.54, 0.9, 2.5, 0.2);
  scene.capture.layers[1][Quantity::kAbsorption].value = {0.05, 0.2, 0.8};
  scene.Light(DiskLight{{130, 0, 130}, {-1, 0, -1}, glm::dvec3(1.0), 0.0, 60.0});
  scene.capture.backings.push_back(
      {.name = "white", .point_mm = {0, 0, -1.5}, .normal = {0, 0, 1}, .size_mm = 30, .reflectance = glm::dvec3(0.8)});
  scene.capture.photographs[0].backing = 0;
  return scene;
}

/// Two layers over a reflecting tile; one channel absorbs more than another.
struct BlockOverTile {
  KnownScene scene = TwoLayersOverTile();
  LayeredBody body = BodyOf(scene);
  VolumeLattice lattice = LatticeOver(body, 0.3);
  Surroundings around{scene.capture, {}, {0}};
  WalkScene walked{body, around.meshes};
  Material material = StatedMaterial(scene.capture);
  Media MediaWith(const Material& m) const { return MediaOf(scene.capture, m, body); }
  PathContext PathContextWith(const Material& m, const Media& media, const PathOptions& options) const {
    return PathContextOf(scene.capture, m, {0}, options, {walked, media, around.things});
  }
};

TEST(LightFields, DerivativesMatchFiniteDifferences) {
  // Without true collisions the rays of light do not depend on the material, so that differences are exact.
  const BlockOverTile block;
  const auto fields = [&](const Material& m, bool derivatives) {
    const Media media = block.MediaWith(m);
    PathOptions options;
    options.derivatives = derivatives;
    return LightFields(block.PathContextWith(m, media, options), block.lattice,
                       {.collisions = 0, .rays = 2000, .least = 1e-12}, 1, 0);
  };
  const std::vector<glm::dvec3> places{{0, 0, -0.2}, {1.5, 0.5, -0.6}, {-1, -1, -1.1}};
  const LightFields exact = fields(block.material, true);
  const auto at = [&](const LightFields& f, const glm::dvec3& p) { return f.Radiance(0, *f.At(p)); };
  for (size_t layer = 0; layer < 2; ++layer)
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption}) {
      const auto moved = [&](double step) {
        Material m = block.material;
        m.layers[layer][q] *= std::exp(step);
        return fields(m, false);
      };
      constexpr double kStep = 0.04;  // fields are single precision; Richardson extrapolation removes the step's error
      const LightFields up = moved(kStep), down = moved(-kStep), far_up = moved(2 * kStep),
                        far_down = moved(-2 * kStep);
      for (const glm::dvec3& p : places) {
        const Spectrum difference =
            (8.0 * (at(up, p) - at(down, p)) - (at(far_up, p) - at(far_down, p))) / (12.0 * kStep);
        const LatticeStencil s = *exact.At(p);
        const Spectrum slope =
            q == Quantity::kAbsorption ? exact.ByAbsorption(0, layer, s) : exact.ByScattering(0, layer, s);
        for (int c = 0; c < kChannels; ++c)
          EXPECT_NEAR(slope[c] / at(exact, p)[c], difference[c] / at(exact, p)[c], 2e-5)
              << "layer " << layer << ", " << RowOf(q).key << ", channel " << c;
      }
    }
}

TEST(TraceLight, BatchSizeIsIndependentOfRayCount) {
  const BlockOverTile block;
  const Media media = block.MediaWith(block.material);
  const PathContext context = block.PathContextWith(block.material, media, {});
  std::vector<double> steps;
  for (const int rays : {5000, 20000}) {
    size_t all = 0, largest = 0;
    const LightRays back = TraceLight(context, block.lattice, 0, {.rays = rays}, 1, 0, 1, [&](const LightRays& lot) {
      all += lot.steps.size();
      largest = std::max(largest, lot.steps.size());
      for (const LightRay& ray : lot.rays) EXPECT_LT(ray.piece, 0);
    });
    for (const LightRay& ray : back.rays) EXPECT_GE(ray.piece, 0);
    EXPECT_FALSE(back.rays.empty());
    EXPECT_LT(largest, 25000);
    steps.push_back(static_cast<double>(all));
  }
  EXPECT_NEAR(steps[1] / steps[0], 4.0, 0.2);
  EXPECT_GT(steps[1], 100000);
}

TEST(Diffusion, WhiteFurnaceIsWhite) {
  // Without absorption, the energy balance is hardest to meet. The boundary condition of diffusion and a rough
  // surface's sampled moments leave an error of 1 %.
  for (const double roughness : {0.0, 0.3}) {
    KnownScene scene(Incisor(), 2, 0.9, 12, 5.0);
    SetLayer(scene, 0, 1.63, 0.68, 2.0, 0.0);
    SetLayer(scene, 1, 1.54, 0.9, 2.0, 0.0);
    SetSurface(scene, roughness, 0.0);
    scene.Light(DomeLight{glm::dvec3(1.0 / std::numbers::pi)});
    const LayeredBody body = BodyOf(scene);
    const VolumeLattice lattice = LatticeOver(body, 0.35);
    PathOptions options{.paths_per_pixel = 200};
    options.lattice = &lattice;
    const PathPhotograph photo =
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
    double sum = 0;
    for (const PixelEstimate& p : photo.pixels) sum += p.mean[1] / static_cast<double>(photo.pixels.size());
    EXPECT_NEAR(sum, 1.0, 0.012) << "roughness " << roughness;
  }
}

/// Blocks of the image on the object: relative difference in brightness between the model and full random walks, also
/// in standard errors.
struct Blocks {
  double rms = 0, total = 0, largest_z = 0;
};
Blocks Compare(const PathPhotograph& truth, const PathPhotograph& model, int side) {
  struct Sum {
    double truth = 0, model = 0, variance = 0;
    int pixels = 0;
  };
  std::map<std::pair<int, int>, Sum> sums;
  Sum all;
  for (size_t i = 0; i < truth.pixels.size(); ++i) {
    if (!truth.pixels[i].on_object) continue;
    const auto [x, y] = std::pair(static_cast<int>(i) % truth.width, static_cast<int>(i) / truth.width);
    for (Sum* s : {&sums[{x / side, y / side}], &all}) {
      s->truth += truth.pixels[i].mean[1], s->model += model.pixels[i].mean[1];
      s->variance += truth.pixels[i].variance()[1] + model.pixels[i].variance()[1];
      ++s->pixels;
    }
  }
  Blocks b;
  int blocks = 0;
  for (const auto& [place, s] : sums) {
    if (2 * s.pixels < side * side) continue;
    const double off = s.model / s.truth - 1.0, noise = std::sqrt(s.variance) / s.truth;
    b.rms += off * off - noise * noise;
    b.largest_z = std::max(b.largest_z, std::abs(off) / noise);
    ++blocks;
  }
  b.rms = std::sqrt(std::max(0.0, b.rms / blocks));
  b.total = all.model / all.truth - 1.0;
  return b;
}

TEST(Diffusion, ConvergesToTheRandomWalkAsCollisionsGrow) {
  KnownScene scene = RoughIncisor(32);
  const LayeredBody body = BodyOf(scene);
  const VolumeLattice lattice = LatticeOver(body, 0.35);
  const auto render = [&](int collisions, int paths) {
    PathOptions options{.paths_per_pixel = paths};
    options.stream = collisions + 1;
    options.collisions = collisions;
    if (collisions > 0) options.lattice = &lattice;
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  };
  const PathPhotograph truth = render(0, 1200);
  const Blocks ten = Compare(truth, render(10, 400), 8), many = Compare(truth, render(300, 1200), 8);
  EXPECT_LT(std::abs(ten.total), 0.02);
  EXPECT_LT(ten.rms, 0.05);
  EXPECT_LT(many.largest_z, 4.0);
  EXPECT_LT(std::abs(many.total), 0.015);
}

TEST(Diffusion, SamePictureForAnyNumberOfThreadsAndLanes) {
  KnownScene scene = RoughIncisor(8);
  scene.capture.layers[1][Quantity::kReducedScattering].value = {2.5, 2.0, 1.5};
  const LayeredBody body = BodyOf(scene);
  const VolumeLattice lattice = LatticeOver(body, 0.4);
  PathOptions options{.paths_per_pixel = 24};
  options.lattice = &lattice;
  const auto render = [&](int threads, int lanes) {
    options.threads = threads, options.lanes = lanes;
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  };
  const PathPhotograph reference = render(1, 64);
  for (const auto& [threads, lanes] : {std::pair(3, 64), std::pair(2, 5)}) {
    const PathPhotograph other = render(threads, lanes);
    for (size_t i = 0; i < other.pixels.size(); ++i) EXPECT_EQ(other.pixels[i].mean, reference.pixels[i].mean);
  }
}

}  // namespace
}  // namespace crownfit
