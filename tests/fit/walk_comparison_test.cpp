// Noise estimates of a path-traced fit: for a photograph's pixels, and for its patch residuals.

#include "fit/walk_comparison.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numeric>

#include "base/random.h"
#include "fit/neighbouring_noise.h"
#include "support/channels.h"

namespace crownfit {
namespace {

struct Scene {
  PhotographCast cast;
  FitPixels pixels;
  std::vector<Spectrum> truth;  ///< per pixel of the cast
};

/// A square of pixels, `stride` apart, whose light is a ramp with a highlight.
Scene Square(int side, int stride) {
  Scene s{{}, {0, -1, {}, {}, {}, {}, {0}, {}, {}}, {}};
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      PixelCast& pixel = s.cast.pixels.emplace_back();
      pixel.x = stride * x, pixel.y = stride * y;
      const double across = static_cast<double>(x) / side, down = static_cast<double>(y) / side;
      const double highlight = 20.0 * std::exp(-200.0 * (std::pow(across - 0.5, 2) + std::pow(down - 0.3, 2)));
      s.truth.push_back((0.2 + across + highlight) * Spectrum{1.0, 0.8, 0.5});
    }
  FitPixels& p = s.pixels;
  p.pixels.resize(s.truth.size());
  std::iota(p.pixels.begin(), p.pixels.end(), 0);
  p.sources = p.pixels;
  for (int i = 0; i < static_cast<int>(s.truth.size()); ++i) {
    p.terms.push_back({i, 1.0f});
    p.first_term.push_back(i + 1);
  }
  return s;
}

/// Noise-weighted brightness of the green pixels relative to the truth, and its error.
std::pair<double, double> Level(const Scene& s, const std::vector<Spectrum>& stddev) {
  double weight = 0, sum = 0;
  for (size_t i = 0; i < s.truth.size(); ++i) {
    const double w = 1.0 / (stddev[i][1] * stddev[i][1]);
    weight += w * s.truth[i][1] * s.truth[i][1];
    sum += w * s.truth[i][1] * s.pixels.values[i][1];
  }
  return {sum / weight, 1.0 / std::sqrt(weight)};
}

TEST(NoiseOfNeighbours, LevelIsUnbiasedWithPerPixelVariances) {
  // Each pixel is the mean of a few paths that find light by chance. Its variance is the sample variance of these
  // paths.
  constexpr int kPaths = 8;
  Scene s = Square(60, 1);
  for (size_t i = 0; i < s.truth.size(); ++i) {
    Spectrum mean, square;
    for (int path = 0; path < kPaths; ++path) {
      const Spectrum found = -std::log(1.0 - Uniform(Key(3, i), path)) * s.truth[i];
      mean += found / static_cast<double>(kPaths);
      square += found * found / static_cast<double>(kPaths);
    }
    s.pixels.values.push_back(mean);
    s.pixels.stddev.push_back(Sqrt((square - mean * mean) / (kPaths - 1.0)));
  }
  EXPECT_LT(Level(s, s.pixels.stddev).first, 0.8) << "per-pixel variances bias it dark";
  const auto [level, error] = Level(s, NoiseOfNeighbours(s.pixels, s.cast, s.pixels.stddev, s.truth));
  EXPECT_NEAR(level, 1.0, 4.0 * error);
  EXPECT_LT(error, 0.01);
}

TEST(NoiseOfNeighbours, LevelIsUnbiasedWithSmoothedVariances) {
  // Few paths find much light. Variances are averaged over 5 pixels, as in a variance image. The reference is the same
  // pixels with variances that are independent of them.
  constexpr int kPaths = 256, kSide = 60, kReach = 5;
  constexpr double kChance = 1.0 / 90.0;
  Scene s = Square(kSide, 1);
  std::fill(s.truth.begin(), s.truth.end(), Spectrum(kChannels, 1.0));
  std::vector<double> variance;
  for (size_t i = 0; i < s.truth.size(); ++i) {
    double mean = 0, square = 0;
    for (int path = 0; path < kPaths; ++path) {
      if (Uniform(Key(4, i), 2 * path) > kChance) continue;
      const double found = -std::log(1.0 - Uniform(Key(4, i), 2 * path + 1)) / kChance;
      mean += found / kPaths;
      square += found * found / kPaths;
    }
    s.pixels.values.emplace_back(kChannels, mean);
    variance.push_back((square - mean * mean) / (kPaths - 1.0));
  }
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      double sum = 0, count = 0;
      for (int v = std::max(0, y - kReach); v <= std::min(kSide - 1, y + kReach); ++v)
        for (int u = std::max(0, x - kReach); u <= std::min(kSide - 1, x + kReach); ++u) {
          if (v == y && u == x) continue;
          sum += variance[static_cast<size_t>(v * kSide + u)];
          ++count;
        }
      s.pixels.stddev.emplace_back(kChannels, std::sqrt(sum / count));
    }
  const double expected = Level(s, std::vector<Spectrum>(s.truth.size(), Spectrum(kChannels, 1.0))).first;
  EXPECT_NEAR(Level(s, NoiseOfNeighbours(s.pixels, s.cast, s.pixels.stddev, s.truth)).first, expected, 0.003);
}

TEST(NoiseOfNeighbours, FollowsAnyPowerLawOfTheSignal) {
  for (const double power : {0.0, 1.0, 2.0})  // read noise, shot noise, noise proportional to the light
    for (const int stride : {1, 7}) {
      Scene s = Square(40, stride);
      for (const Spectrum& truth : s.truth)
        s.pixels.stddev.push_back(0.01 * truth.Mapped([&](double v) { return std::pow(v, 0.5 * power); }));
      const auto found = NoiseOfNeighbours(s.pixels, s.cast, s.pixels.stddev, s.truth);
      for (size_t i = 0; i < found.size(); ++i)
        EXPECT_NEAR(found[i][1] / s.pixels.stddev[i][1], 1.0, 1e-9) << power << " " << stride;
    }
}

TEST(NoiseOfNeighbours, FallsBackToThePixelWithoutNeighbours) {
  Scene s = Square(2, 1);
  for (const double v : {0.1, 0.2, 0.3, 0.4}) s.pixels.stddev.emplace_back(kChannels, v);
  EXPECT_EQ(NoiseOfNeighbours(s.pixels, s.cast, s.pixels.stddev, s.truth), s.pixels.stddev);
}

TEST(OverNearest, AveragesAPixelAndItsNearestNeighbours) {
  for (const int stride : {1, 2, 4}) {
    Scene s = Square(12, stride);
    std::vector<Spectrum> ramp;
    for (const PixelCast& pixel : s.cast.pixels) ramp.emplace_back(kChannels, pixel.x + 100.0 * pixel.y);
    const auto found = OverNearest(s.pixels, s.cast, ramp);
    EXPECT_NEAR(found[5 * 12 + 5][0], ramp[5 * 12 + 5][0], 1e-9) << stride;
    EXPECT_NEAR(found[5 * 12][0], ramp[5 * 12][0] + 0.5 * stride, 1e-9) << stride << ", at the rim";
  }
  const Scene far = Square(12, 20);
  EXPECT_EQ(OverNearest(far.pixels, far.cast, far.truth), far.truth) << "it has no neighbour";
}

/// The scene rendered with a few paths per pixel, nearly grey: most paths find nothing, a few find much.
PathPhotograph Walked(const Scene& s, int side, uint64_t draw) {
  constexpr int kPaths = 16;
  constexpr double kChance = 0.1, kOfOneChannel = 0.1;
  PathPhotograph walked;
  walked.width = walked.height = side;
  walked.groups = kPaths;
  auto ranks = std::make_shared<std::vector<uint32_t>>();
  for (size_t i = 0; i < s.truth.size(); ++i) {
    PixelEstimate& pixel = walked.pixels.emplace_back();
    pixel.on_object = true;
    Spectrum square;
    for (int path = 0; path < kPaths; ++path) {
      RandomStream random(Key(draw, i, path));
      Spectrum found(kChannels, random.Next() < kChance ? -std::log(1.0 - random.Next()) / kChance : 0.0);
      for (int c = 0; c < kChannels; ++c) found[c] = s.truth[i][c] * (found[c] + kOfOneChannel * (random.Next() - 0.5));
      walked.group_values.push_back(found);
      pixel.mean += found / static_cast<double>(kPaths);
      square += found * found / static_cast<double>(kPaths);
    }
    const Spectrum variance = (square - pixel.mean * pixel.mean) / (kPaths - 1.0);
    pixel.covariance = {variance[0], 0, 0, variance[1], 0, variance[2]};
    walked.rendered.push_back(i);
    ranks->push_back(static_cast<uint32_t>(i));
  }
  walked.ranks = ranks;
  return walked;
}

TEST(PatchChi2, StddevMatchesScatterWhenPhotographsSharePaths) {
  constexpr int kSide = 48, kDraws = 60;
  for (const double noise : {0.2, 1.0}) {  // relative to the light; path-traced noise is 1.1
    Scene s = Square(kSide, 1);
    std::vector<FitPixels> photographs(3, s.pixels);
    for (size_t k = 0; k < photographs.size(); ++k)
      for (size_t i = 0; i < s.truth.size(); ++i) {
        RandomStream random(Key(5, k, i));
        const double off = std::sqrt(12.0) * noise * (random.Next() - 0.5);
        photographs[k].values.push_back(s.truth[i] * (1.0 + off));
        photographs[k].stddev.push_back(noise * s.truth[i]);
      }
    double mean = 0, square = 0, stated = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      const PathPhotograph walked = Walked(s, kSide, static_cast<uint64_t>(draw));
      WalkComparison total;
      for (const FitPixels& p : photographs) total.AddSums(CompareWithWalks(p, s.cast, walked, 1.0));
      const PatchChi2 left = total.Left().patches;
      mean += left.chi2 / kDraws;
      square += left.chi2 * left.chi2 / kDraws;
      stated += left.stddev / kDraws;
    }
    const double scatter = std::sqrt((square - mean * mean) * kDraws / (kDraws - 1.0));
    EXPECT_NEAR(mean, 1.0, 0.3) << noise;
    // Leaving groups out counts the squared path-tracing noise twice: up to root 2 too much, never too little.
    EXPECT_GT(stated / scatter, 0.8) << noise;
    EXPECT_LT(stated / scatter, 1.8) << noise;
  }
}

TEST(PatchChi2, RegionsDetectGradientsThatPatchesMiss) {
  constexpr int kSide = 96;
  constexpr double kNoise = 0.01;         // relative to the light; path-traced noise is 1.1
  for (const double fall : {0.0, 0.3}) {  // relative fall-off from left to right, which the model lacks
    Scene s = Square(kSide, 1);
    for (size_t i = 0; i < s.truth.size(); ++i) {
      const double across = s.cast.pixels[i].x / static_cast<double>(kSide);
      s.pixels.values.push_back(s.truth[i] * (1.0 + fall * (0.5 - across)));
      s.pixels.stddev.push_back(kNoise * s.truth[i]);
    }
    const WalkComparison c = CompareWithWalks(s.pixels, s.cast, Walked(s, kSide, 0), 1.0);
    const auto [patches, regions] = c.Left();
    EXPECT_EQ(regions.values, 3 * 16);
    EXPECT_LT(patches.chi2, 2.0) << fall;
    EXPECT_EQ(regions.IsMoreThan(1.5), fall > 0.0) << regions.chi2 << " +- " << regions.StddevByChance();
  }
}

}  // namespace
}  // namespace crownfit
