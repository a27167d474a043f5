// Derivatives of walked pictures: against differences, against an exact sum, and what a solver makes of them.

#include <gtest/gtest.h>

#include <cmath>

#include "fit_path/walked_step.h"
#include "path/pooled_derivatives.h"
#include "support/channels.h"
#include "support/shapes.h"
#include "support/walked.h"

namespace crownfit {
namespace {

constexpr int kKinds = 3;  // derivatives of a layer

void SetLayer(KnownScene& scene, size_t layer, double ior, double g, const Spectrum& scattering,
              const Spectrum& absorption) {
  LayerSpec& l = scene.capture.layers[layer];
  l[Quantity::kIor].value.fill(ior);
  l[Quantity::kAsymmetry].value.fill(g);
  l[Quantity::kReducedScattering].value = scattering;
  l[Quantity::kAbsorption].value = absorption;
}

/// Two layers whose channels scatter and absorb very differently, under light from everywhere.
KnownScene Coloured(TriangleMesh mesh, double thickness_mm, int pixels, double view_mm) {
  KnownScene scene(std::move(mesh), 2, thickness_mm, pixels, view_mm);
  SetLayer(scene, 0, 1.62, 0.7, {1.0, 2.0, 3.0}, {0.03, 0.1, 0.3});
  SetLayer(scene, 1, 1.54, 0.8, {3.0, 2.0, 1.2}, {0.1, 0.3, 0.9});
  scene.capture.layers[0][Quantity::kIsotropicFraction].value.fill(0.1);
  scene.Light(DomeLight{glm::dvec3(0.3)});
  return scene;
}

/// Means over the object of the values, or per layer of the derivatives.
struct Means {
  Spectrum value;
  std::array<std::array<Spectrum, kKinds>, 2> slope{};
  std::array<std::array<Spectrum, 2>, 2> control{};
};

Means MeansOf(const PathPhotograph& photo) {
  Means m;
  double n = 0;
  for (size_t p = 0; p < photo.pixels.size(); ++p) {
    if (!photo.pixels[p].on_object) continue;
    ++n;
    m.value += photo.pixels[p].mean;
    for (size_t g = 0; g < photo.groups; ++g)
      for (size_t l = 0; l < photo.layers && photo.derivatives.size() > 0; ++l) {
        const GroupDerivatives& s = photo.derivatives;
        const size_t i = (p * photo.groups + g) * photo.layers + l;
        const Spectrum derivatives[] = {s.scattering[i], s.absorption[i], s.asymmetry[i]},
                       controls[] = {s.scattering_control[i], s.asymmetry_control[i]};
        for (int k = 0; k < kKinds; ++k) m.slope[l][k] += derivatives[k] / static_cast<double>(photo.groups);
        for (int k = 0; k < 2; ++k) m.control[l][k] += controls[k] / static_cast<double>(photo.groups);
      }
  }
  m.value /= n;
  for (auto& layer : m.slope)
    for (auto& s : layer) s /= n;
  for (auto& layer : m.control)
    for (auto& c : layer) c /= n;
  return m;
}

struct Case {
  const char* name;
  KnownScene scene;
  int paths;
};
std::vector<Case> Cases() {
  std::vector<Case> cases;
  cases.push_back({"slab", Coloured(Box({-20, -20, -2}, {20, 20, 0}), 0.7, 3, 1.0), 240});
  cases.push_back({"sphere", Coloured(Sphere(1.5, 24), 0.4, 6, 2.6), 54});
  cases.push_back({"crown", Coloured(Incisor(), 0.9, 8, 10.0), 54});
  SetLayer(cases[2].scene, 0, 1.63, 0.68, {2.1, 2.1, 2.1}, {0.01, 0.03, 0.08});  // one walk for all channels
  SetLayer(cases[2].scene, 1, 1.54, 0.8, {2.0, 2.0, 2.0}, {0.03, 0.1, 0.3});
  return cases;
}

TEST(PathDerivatives, AgreeWithCentralDifferencesAndTheirControlsVanish) {
  constexpr int kSeeds = 20;
  constexpr double kSteps[] = {0.1, 0.03, 0.03}, kTruncation = 2e-3;  // of the difference
  const Quantity quantities[] = {Quantity::kReducedScattering, Quantity::kAbsorption, Quantity::kAsymmetry};
  for (const Case& c : Cases()) {
    const LayeredBody body = BodyOf(c.scene);
    const Material material = StatedMaterial(c.scene.capture);
    const auto render = [&](const Material& m, int seed, bool derivatives) {
      PathOptions options{.paths_per_pixel = c.paths, .seed = static_cast<uint64_t>(seed)};
      options.derivatives = derivatives;
      return MeansOf(RenderByPaths(c.scene.capture, body, {}, m, 0, options, [](double) {}));
    };
    std::vector<Means> at;
    for (int seed = 0; seed < kSeeds; ++seed) at.push_back(render(material, seed, true));
    double squares = 0, count = 0;
    for (int l = 0; l < 2; ++l)
      for (int k = 0; k < kKinds; ++k) {
        std::array<Mean, kChannels> difference, gap, control;
        for (int seed = 0; seed < kSeeds; ++seed) {
          Material up = material, down = material;
          for (int ch = 0; ch < kChannels; ++ch) {
            double &u = up.layers[l][quantities[k]][ch], &d = down.layers[l][quantities[k]][ch];
            if (quantities[k] == Quantity::kAsymmetry) {
              u += kSteps[k], d -= kSteps[k];
            } else {
              u *= std::exp(kSteps[k]), d *= std::exp(-kSteps[k]);
            }
          }
          const Spectrum slope = (render(up, seed, false).value - render(down, seed, false).value) / (2 * kSteps[k]);
          for (int ch = 0; ch < kChannels; ++ch) {
            difference[ch].Add(slope[ch]);
            gap[ch].Add(at[seed].slope[l][k][ch] - slope[ch]);
            if (k != 1) control[ch].Add(at[seed].control[l][k / 2][ch]);
          }
        }
        for (int ch = 0; ch < kChannels; ++ch) {
          const double z = gap[ch].value() / (gap[ch].error() + kTruncation * std::abs(difference[ch].value()));
          EXPECT_LT(std::abs(z), 3.5) << c.name << ", layer " << l << ", slope " << k << ", channel " << ch << ": "
                                      << gap[ch].value() << " off " << difference[ch].value();
          squares += z * z, ++count;
          if (k == 1) continue;
          EXPECT_LT(std::abs(control[ch].value()), 3.5 * control[ch].error()) << c.name << l << k << ch;
        }
      }
    std::printf("%s: rms %.2f standard errors over %.0f slopes\n", c.name, std::sqrt(squares / count), count);
    EXPECT_LT(std::sqrt(squares / count), 1.5) << c.name;
  }
}

TEST(PathDerivatives, ScalingEveryLengthIsTheSumOfAllCoefficientsSlopes) {
  // A scene twice as large with coefficients half as large gives the same picture, walk for walk. So its derivative by
  // the logarithm of its size is the sum of those by all coefficients.
  constexpr double kStep = 0.03;
  const KnownScene scene = Coloured(Sphere(1.5, 24), 0.4, 6, 2.6);
  const LayeredBody body = BodyOf(scene);
  std::vector<TriangleMesh> larger = body.surfaces, smaller = body.surfaces;
  for (auto& mesh : larger)
    for (auto& v : mesh.vertices) v *= std::exp(kStep);
  for (auto& mesh : smaller)
    for (auto& v : mesh.vertices) v *= std::exp(-kStep);
  const LayeredBody large(larger, 0), small(smaller, 0);
  const auto with_camera = [&](double factor) {
    Capture capture = scene.capture;
    capture.photographs[0].camera_from_object.translation_mm *= factor;
    return capture;
  };
  const Capture far = with_camera(std::exp(kStep)), near = with_camera(std::exp(-kStep));
  const Material material = StatedMaterial(scene.capture);
  std::array<Mean, kChannels> gap;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    PathOptions options{.paths_per_pixel = 150, .seed = seed};
    const Spectrum size = (MeansOf(RenderByPaths(far, large, {}, material, 0, options, [](double) {})).value -
                           MeansOf(RenderByPaths(near, small, {}, material, 0, options, [](double) {})).value) /
                          (2 * kStep);
    options.derivatives = true;
    const Means at = MeansOf(RenderByPaths(scene.capture, body, {}, material, 0, options, [](double) {}));
    const Spectrum sum = at.slope[0][0] + at.slope[0][1] + at.slope[1][0] + at.slope[1][1];
    for (int c = 0; c < kChannels; ++c) gap[c].Add(sum[c] - size[c]);
  }
  for (int c = 0; c < kChannels; ++c) EXPECT_LT(std::abs(gap[c].value()), 3 * gap[c].error()) << c;
}

TEST(PathDerivatives, DoNotDependOnLanesOrThreads) {
  KnownScene scene = Coloured(Incisor(), 0.9, 6, 10.0);
  const LayeredBody body = BodyOf(scene);
  const auto render = [&](int lanes, int threads) {
    PathOptions options{.paths_per_pixel = 24, .threads = threads};
    options.lanes = lanes;
    options.derivatives = true;
    return RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  };
  const PathPhotograph a = render(64, 1), b = render(5, 3);
  EXPECT_GT(a.derivatives.size(), 0);
  EXPECT_EQ(a.derivatives.scattering, b.derivatives.scattering);
  EXPECT_EQ(a.derivatives.absorption, b.derivatives.absorption);
  EXPECT_EQ(a.derivatives.asymmetry, b.derivatives.asymmetry);
  EXPECT_EQ(a.derivatives.scattering_control, b.derivatives.scattering_control);
  EXPECT_EQ(a.derivatives.asymmetry_control, b.derivatives.asymmetry_control);
  EXPECT_EQ(a.group_values, b.group_values);
}

TEST(PooledDerivatives, HaveTheSumOfTheirPathsAndErrorsThatTheyMake) {
  const KnownScene scene = SmoothIncisor(16, false);
  const LayeredBody body = BodyOf(scene);
  constexpr int kSeeds = 12;
  std::array<Mean, 6> found;
  std::array<double, 6> stated{}, raw{};
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    PathOptions options{.paths_per_pixel = 64, .seed = seed};
    options.derivatives = true;
    const PathPhotograph photo =
        RenderByPaths(scene.capture, body, {}, StatedMaterial(scene.capture), 0, options, [](double) {});
    const PooledDerivatives pooled(photo);
    const Means means = MeansOf(photo);
    for (int j = 0; j < 6; ++j) {
      // Mean over the object of the blue channel's slope, with the jackknife's error.
      double n = 0, sum = 0;
      std::vector<double> without(pooled.groups(), 0.0);
      for (size_t p = 0; p < photo.pixels.size(); ++p) {
        if (!photo.pixels[p].on_object) continue;
        ++n;
        sum += pooled.brightness(2, p) * pooled.At(j, 2, p);
        const std::vector<double> some = pooled.Without(j, 2, p);
        for (int g = 0; g < pooled.groups(); ++g) without[g] += pooled.brightness(2, p) * some[g];
      }
      double mean = 0, square = 0;
      for (const double w : without) mean += w / n, square += w / n * w / n;
      const double groups = pooled.groups();
      found[j].Add(sum / n);
      stated[j] += (square - mean * mean / groups) * (groups - 1) / groups / kSeeds;
      raw[j] += means.slope[j / 3][j % 3][2] / kSeeds;
    }
  }
  for (int j = 0; j < 6; ++j) {
    const double scatter = found[j].error() * std::sqrt(kSeeds);
    EXPECT_NEAR(found[j].value(), raw[j], 4 * found[j].error() + 0.02 * std::abs(raw[j])) << j;
    EXPECT_GT(scatter, 0.5 * std::sqrt(stated[j])) << j;
    EXPECT_LT(scatter, 1.7 * std::sqrt(stated[j])) << j;
  }
}

TEST(PooledDerivatives, OfPixelsAroundTheObjectAreThoseOfTheirOwnPaths) {
  const KnownScene scene = SmoothIncisor(16, false);
  PathOptions options{.paths_per_pixel = 400};
  options.derivatives = true;
  const PathPhotograph photo =
      RenderByPaths(scene.capture, BodyOf(scene), {}, StatedMaterial(scene.capture), 0, options, [](double) {});
  const PooledDerivatives pooled(photo);
  constexpr size_t kDentine = 1, kAbsorptionOfDentine = 3 * kDentine + 1;
  double rim = 0, all = 0, rim_of_paths = 0, all_of_paths = 0;
  for (size_t p = 0; p < photo.pixels.size(); ++p) {
    double of_paths = 0;
    for (size_t g = 0; g < photo.groups; ++g)
      of_paths += photo.derivatives.absorption.at((p * photo.groups + g) * photo.layers + kDentine, 1);
    of_paths /= static_cast<double>(photo.groups);
    const PooledDerivatives::OfPixel slope = pooled.DerivativeOf(kAbsorptionOfDentine, 1, p);
    all += slope.value, all_of_paths += of_paths;
    if (photo.pixels[p].on_object) continue;
    rim += slope.value, rim_of_paths += of_paths;
    EXPECT_EQ(slope.stddev > 0, slope.value != 0) << p;
  }
  EXPECT_LT(rim, 0.005 * all) << "a picture of 16 x 16 pixels has a rim";
  EXPECT_NEAR(rim, rim_of_paths, 1e-9 * std::abs(rim));
  EXPECT_NEAR(all, all_of_paths, 0.03 * std::abs(all_of_paths));
}

TEST(PooledDerivatives, AreNothingWhereThereIsNoLightOrNoObject) {
  KnownScene scene = SmoothIncisor(8, false);
  scene.capture.lights[0].shape = DomeLight{{1.0, 0.0, 1.0}};
  PathOptions options{.paths_per_pixel = 16};
  options.derivatives = true;
  const auto derivatives = [&] {
    return PooledDerivatives(
        RenderByPaths(scene.capture, BodyOf(scene), {}, StatedMaterial(scene.capture), 0, options, [](double) {}));
  };
  const PooledDerivatives dark = derivatives();
  EXPECT_LT(dark.At(1, 0, 27), 0.0);
  EXPECT_EQ(dark.At(1, 1, 27), 0.0);
  EXPECT_EQ(dark.Stddev(1, 1, 27), 0.0);
  scene.capture.photographs[0].camera_from_object.translation_mm.x += 100;
  EXPECT_EQ(derivatives().At(1, 0, 27), 0.0);
}

TEST(WalkedStep, FindsWhatChangedWithinItsErrors) {
  // Absorption of both layers, from light from everywhere; ./dev bench steps does it with eight unknowns and 20 seeds.
  const KnownScene scene = SmoothIncisor(16, false);
  const LayeredBody body = BodyOf(scene);
  const Material start = StatedMaterial(scene.capture);
  Material truth = start;
  for (int c = 0; c < kChannels; ++c) {
    truth.layers[0][Quantity::kAbsorption][c] *= std::exp(0.06);
    truth.layers[1][Quantity::kAbsorption][c] *= std::exp(-0.04);
  }
  const auto render = [&](const Material& m, uint64_t seed, bool derivatives) {
    PathOptions options{.paths_per_pixel = 1500, .seed = seed};
    options.derivatives = derivatives;
    return RenderByPaths(scene.capture, body, {}, m, 0, options, [](double) {});
  };
  const PathPhotograph observed = render(truth, 1, false), predicted = render(start, 2, false);
  const PooledDerivatives derivatives(render(start, 3, true));
  const RowsOfSlopes rows(
      {{&derivatives, 1.0}},
      [](const DerivativeParameter& p, int) -> Eigen::RowVectorXd {
        if (p.quantity != Quantity::kAbsorption) return {};
        return Eigen::RowVectorXd::Unit(2, static_cast<Eigen::Index>(p.layer));
      },
      2);
  WalkedStep step(2, derivatives.groups());
  for (size_t p = 0; p < observed.pixels.size(); ++p) {
    if (!observed.pixels[p].on_object) continue;
    const Spectrum off = observed.pixels[p].mean - predicted.pixels[p].mean;
    const Eigen::MatrixXd of_walks = CovarianceOf(predicted.pixels[p]);
    WalkedRows row = rows.Zero();
    rows.AddTo(row, p, 1.0);
    step.Add({Eigen::Vector3d(off[0], off[1], off[2]), CovarianceOf(observed.pixels[p]) + of_walks, of_walks}, row);
  }
  const WalkedStep::Prior none{Eigen::Matrix2d::Zero(), Eigen::Vector2d::Zero()};
  const WalkedStep::Solution s = step.Solve(none);
  EXPECT_TRUE(s.seen);
  for (int i = 0; i < 2; ++i) {
    const double stddev = std::sqrt(s.covariance(i, i));
    EXPECT_LT(stddev, 0.012) << i;
    EXPECT_NEAR(s.step[i], i == 0 ? 0.06 : -0.04, 3 * stddev) << i;
    EXPECT_GT(s.walk_covariance(i, i), 0.3 * s.covariance(i, i)) << "observed and predicted by as many paths";
    EXPECT_LT(s.walk_covariance(i, i), 0.8 * s.covariance(i, i));
  }
  const WalkedStep::Solution held = step.Solve(none, {0});
  EXPECT_EQ(held.step[0], 0.0);
  EXPECT_EQ(held.covariance(0, 0), 0.0);
  EXPECT_LT(held.covariance(1, 1), s.covariance(1, 1)) << "one unknown fewer";
  const WalkedStep::Prior sure{Eigen::Vector2d(1e8, 0.0).asDiagonal(), Eigen::Vector2d::Zero()};
  EXPECT_NEAR(step.Solve(sure).step[1], held.step[1], 1e-3) << "a sure prior holds as well";
}

TEST(WalkedStep, WhatSlopesTellNoBetterThanNoiseLeavesTheOthersAsTheyAre) {
  // Pixels that one unknown moves by 1 and another one not at all, but for its derivatives' noise.
  constexpr int kSeeds = 60, kPixels = 300, kGroups = 16;
  constexpr double kTruth = 0.1, kPrior = 3.0;
  int seen = 0;
  double chi2 = 0;
  for (uint64_t seed = 0; seed < kSeeds; ++seed) {
    WalkedStep step(2, kGroups);
    for (uint64_t p = 0; p < kPixels; ++p) {
      Eigen::Vector3d residual;
      WalkedRows::Rows all = WalkedRows::Rows::Zero(kChannels, 2);
      std::vector<WalkedRows::Rows> without(kGroups, all);
      for (int c = 0; c < kChannels; ++c) {
        auto gaussian = [&, number = uint64_t{0}]() mutable { return Gaussian(Key(seed, p), 32 * c + number++); };
        residual[c] = kTruth + gaussian();
        Eigen::VectorXd of_groups(kGroups);
        for (double& g : of_groups) g = 2.0 * gaussian();
        all.row(c) << 1.0, of_groups.mean();
        for (int g = 0; g < kGroups; ++g) without[g].row(c) << 1.0, (of_groups.sum() - of_groups[g]) / (kGroups - 1);
      }
      step.Add({residual, Eigen::Matrix3d::Identity()}, {all, without, WalkedRows::Rows(kChannels, 0)});
    }
    const WalkedStep::Prior wide{Eigen::Matrix2d::Identity() / (kPrior * kPrior), Eigen::Vector2d::Zero()};
    const WalkedStep::Solution s = step.Solve(wide);
    seen += s.seen;
    const double variance = s.covariance(0, 0);
    chi2 += (s.step[0] - kTruth) * (s.step[0] - kTruth) / variance / kSeeds;
    if (s.seen) continue;
    EXPECT_NEAR(s.covariance(1, 1), kPrior * kPrior, 0.5 * kPrior * kPrior) << "nothing is known but the prior";
  }
  EXPECT_LT(seen, kSeeds / 5);
  EXPECT_LT(chi2, 1.0 + 4 * std::sqrt(2.0 / kSeeds)) << "the error of the other one is at most what is stated";
  EXPECT_GT(chi2, 0.25) << "and not much less, though what it leans on the unknown by is noise too";
}

TEST(WalkedStep, WhereSlopesTellNothingAtAllThePriorIsWhatIsKnown) {
  constexpr int kGroups = 16;
  WalkedStep step(2, kGroups);
  for (uint64_t p = 0; p < 100; ++p) {
    const Eigen::Vector3d residual = Eigen::Vector3d::Constant(Gaussian(p, 0));
    std::vector<WalkedRows::Rows> without(kGroups, WalkedRows::Rows::Zero(kChannels, 2));
    step.Add({residual, Eigen::Matrix3d::Identity()},
             {WalkedRows::Rows::Zero(kChannels, 2), without, WalkedRows::Rows(kChannels, 0)});
  }
  const WalkedStep::Prior prior{Eigen::Vector2d(4.0, 25.0).asDiagonal(), Eigen::Vector2d(2.0, 0.0)};
  const WalkedStep::Solution s = step.Solve(prior);
  EXPECT_FALSE(s.seen);
  EXPECT_NEAR(s.step[0], 0.5, 1e-12);
  EXPECT_NEAR(s.covariance(0, 0), 1.0 / 4.0, 1e-12);
  EXPECT_NEAR(s.covariance(1, 1), 1.0 / 25.0, 1e-12);
  const WalkedStep::Solution held = step.Solve(prior, {0, 1});
  EXPECT_EQ(held.step, Eigen::VectorXd::Zero(2)) << "all of them at an end of their ranges";
}

TEST(WalkedStep, AnUnknownThatMovesNoPixelLeavesTheOthersWhatTheyAre) {
  // Three told, with noise in their derivatives, and one that no pixel depends on, at every place among them.
  constexpr int kGroups = 16, kUnknowns = 4;
  constexpr double kTruth = 0.1;
  for (int dead = 0; dead < kUnknowns; ++dead) {
    WalkedStep step(kUnknowns, kGroups);
    for (uint64_t p = 0; p < 200; ++p) {
      auto gaussian = [&, number = uint64_t{0}]() mutable { return Gaussian(Key(5, p), number++); };
      Eigen::Vector3d residual;
      WalkedRows::Rows all = WalkedRows::Rows::Zero(kChannels, kUnknowns);
      std::vector<WalkedRows::Rows> without(kGroups, all);
      for (int c = 0; c < kChannels; ++c) {
        double moved = 0;
        for (int k = 0; k < kUnknowns; ++k) {
          if (k == dead) continue;
          const double slope = gaussian();
          moved += kTruth * slope;
          for (int g = 0; g < kGroups; ++g) {
            const double noise = 0.3 * gaussian();
            for (int other = 0; other < kGroups; ++other)
              without[other](c, k) += (slope + noise) * (other == g ? 0.0 : 1.0 / (kGroups - 1));
            all(c, k) += (slope + noise) / kGroups;
          }
        }
        residual[c] = moved + 0.3 * gaussian();
      }
      step.Add({residual, 0.09 * Eigen::Matrix3d::Identity()}, {all, without, WalkedRows::Rows(kChannels, 0)});
    }
    const WalkedStep::Prior wide{Eigen::MatrixXd::Identity(kUnknowns, kUnknowns) / 9.0,
                                 Eigen::VectorXd::Zero(kUnknowns)};
    const WalkedStep::Solution s = step.Solve(wide);
    EXPECT_FALSE(s.seen);
    for (int k = 0; k < kUnknowns; ++k) {
      if (k == dead) {
        EXPECT_EQ(s.step[k], 0.0);
        EXPECT_NEAR(s.covariance(k, k), 9.0, 1e-9);
      } else {
        EXPECT_NEAR(s.step[k], kTruth, 4 * std::sqrt(s.covariance(k, k))) << k << " beside " << dead;
        EXPECT_LT(std::sqrt(s.covariance(k, k)), 0.03) << k << " beside " << dead;
      }
    }
  }
}

TEST(WalkedStep, NoiseThatPixelsShareDoesNotAverageOut) {
  // One unknown, a hundred pixels whose predictions have walks in common, or not.
  constexpr int kPixels = 100, kGroups = 16;
  for (const bool is_shared : {false, true}) {
    WalkedStep step(1, kGroups);
    for (int p = 0; p < kPixels; ++p) {
      WalkedStep::Pixel pixel{Eigen::Vector3d::Constant(0.1), 2.0 * Eigen::Matrix3d::Identity(),
                              Eigen::Matrix3d::Identity()};
      // Means of groups of paths scatter by sqrt(groups) of what their mean does.
      pixel.off_by_group = Eigen::MatrixXd::Zero(kChannels, kGroups);
      for (int g = 0; g < kGroups; ++g)
        for (int c = 0; c < kChannels; ++c)
          pixel.off_by_group(c, g) =
              std::sqrt(kGroups) * Gaussian(Key(7, is_shared ? 0 : p), static_cast<uint64_t>(g * kChannels + c));
      const WalkedRows::Rows one = WalkedRows::Rows::Ones(kChannels, 1);
      step.Add(pixel, {one, std::vector<WalkedRows::Rows>(kGroups, one), WalkedRows::Rows(kChannels, 0)});
    }
    const WalkedStep::Solution s = step.Solve({Eigen::MatrixXd::Zero(1, 1), Eigen::VectorXd::Zero(1)});
    const double values = kChannels * kPixels, of_walks = is_shared ? 1.0 / kChannels : 1.0 / values;
    EXPECT_NEAR(std::sqrt(s.walk_covariance(0, 0)), std::sqrt(of_walks), 0.4 * std::sqrt(of_walks));
    EXPECT_NEAR(s.covariance(0, 0) - s.walk_covariance(0, 0), 1.0 / values, 1e-12) << "what cameras add";
  }
}

}  // namespace
}  // namespace crownfit
