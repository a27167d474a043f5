// One Gauss-Newton step of eight parameters from two path-traced photographs of an incisor, over many seeds. It checks
// whether the step is right and whether its stated errors match its actual errors.
//
// usage: step_study [SEEDS]      exit 1: fewer than 93 % or more than 98 % of the values within two standard
// deviations,
//                                or chi2 over the parameters is not distributed as chi2

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <utility>

#include "base/linear_algebra.h"
#include "base/parallel.h"
#include "fit_path/walked_step.h"
#include "path/pooled_derivatives.h"
#include "scene/crown_source.h"
#include "support/channels.h"
#include "support/known_scene.h"

namespace {

using namespace crownfit;

constexpr int kPixels = 48, kUnknowns = 8;
const char* const kNames[kUnknowns] = {"enamel s'",  "dentine s'",  "enamel a R",  "enamel a G",
                                       "enamel a B", "dentine a R", "dentine a G", "dentine a B"};
constexpr double kSensor = 0.01, kFloor = 1.6e-4;  // relative, absolute

int UnknownOfSlope(const DerivativeParameter& p, int channel) {
  const int layer = static_cast<int>(p.layer);
  if (p.quantity == Quantity::kReducedScattering) return layer;
  return p.quantity == Quantity::kAbsorption ? 2 + kChannels * layer + channel : -1;
}

/// The material with ln parameters moved.
Material Moved(Material m, const Eigen::VectorXd& x) {
  for (size_t l = 0; l < m.layers.size(); ++l)
    for (const Quantity q : {Quantity::kReducedScattering, Quantity::kAbsorption})
      for (int c = 0; c < kChannels; ++c) m.layers[l][q][c] *= std::exp(x[UnknownOfSlope({l, q}, c)]);
  return m;
}

/// A pixel's position in the image, and its input to the step.
using Compared = std::pair<size_t, WalkedStep::Pixel>;

/// Differences and their covariance, averaged over the neighbours: a pixel's own covariance varies with its value.
std::vector<Compared> Compare(const PathPhotograph& observed, const PathPhotograph& predicted, uint64_t key) {
  constexpr int kReach = 3;
  std::vector<Compared> pixels;
  for (size_t p = 0; p < predicted.pixels.size(); ++p) {
    if (!predicted.pixels[p].on_object) continue;
    const int x = static_cast<int>(p) % kPixels, y = static_cast<int>(p) / kPixels;
    PixelEstimate all{.mean = Spectrum(kChannels, 0.0), .covariance = ChannelCovariance(6)}, of_walks = all;
    double n = 0;
    for (int v = std::max(0, y - kReach); v <= std::min(kPixels - 1, y + kReach); ++v)
      for (int u = std::max(0, x - kReach); u <= std::min(kPixels - 1, x + kReach); ++u) {
        const size_t q = static_cast<size_t>(v) * kPixels + u;
        if (!predicted.pixels[q].on_object) continue;
        for (int k = 0; k < 6; ++k) {
          all.covariance[k] += observed.pixels[q].covariance[k] + predicted.pixels[q].covariance[k];
          of_walks.covariance[k] += predicted.pixels[q].covariance[k];
        }
        all.mean += predicted.pixels[q].mean, ++n;
      }
    for (PixelEstimate* sums : {&all, &of_walks}) {
      for (double& v : sums->covariance) v /= n;
      sums->mean /= n;
    }
    Eigen::Vector3d residual;
    for (int c = 0; c < kChannels; ++c) {
      const double sensor = std::hypot(kSensor * all.mean[c], kFloor);
      all.covariance[PairOf(c, c, kChannels)] += sensor * sensor;
      residual[c] =
          observed.pixels[p].mean[c] - predicted.pixels[p].mean[c] + sensor * Gaussian(key, p * kChannels + c);
    }
    pixels.push_back({p, {residual, CovarianceOf(all), CovarianceOf(of_walks)}});
  }
  return pixels;
}

WalkedStep::Solution Step(const LayeredBody& body, const Eigen::VectorXd& truth, uint64_t seed) {
  std::optional<WalkedStep> step;
  for (const bool has_softbox : {true, false}) {
    const KnownScene scene = SmoothIncisor(kPixels, has_softbox);
    const Material start = StatedMaterial(scene.capture);
    const auto render = [&](const Material& material, int paths, uint64_t run, bool derivatives) {
      PathOptions options{.paths_per_pixel = paths, .seed = Key(seed, run, has_softbox), .threads = 1};
      options.derivatives = derivatives;
      options.estimator = Estimator::kCollisions;
      return RenderByPaths(scene.capture, body, {}, material, 0, options, [](double) {});
    };
    const PathPhotograph observed = render(Moved(start, truth), 512, 1, false),
                         predicted = render(start, 512, 2, false);
    const PooledDerivatives derivatives(render(start, 1536, 3, true));
    const RowsOfSlopes rows(
        {{&derivatives, 1.0}},
        [](const DerivativeParameter& p, int channel) -> Eigen::RowVectorXd {
          const int unknown = UnknownOfSlope(p, channel);
          if (unknown < 0) return {};
          return Eigen::RowVectorXd::Unit(kUnknowns, unknown);
        },
        kUnknowns);
    if (!step) step.emplace(kUnknowns, derivatives.groups());
    for (const auto& [place, pixel] : Compare(observed, predicted, Key(seed, 4, has_softbox))) {
      WalkedRows row = rows.Zero();
      rows.AddTo(row, place, 1.0);
      step->Add(pixel, std::move(row));
    }
  }
  return step->Solve({Eigen::MatrixXd::Zero(kUnknowns, kUnknowns), Eigen::VectorXd::Zero(kUnknowns)});
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 20;
  const KnownScene scene = SmoothIncisor(kPixels);
  const LayeredBody body(BuildSurfaces(scene.capture, scene.source, StatedThicknesses(scene.capture)), 0);
  Eigen::VectorXd truth(kUnknowns);
  truth << 0.1, 0.05, 0.1, 0.1, 0.1, 0.05, 0.05, 0.05;
  std::vector<WalkedStep::Solution> found(seeds);
  ParallelFor(found.size(), 0, [&](size_t i) {
    found[i] = Step(body, truth, i + 1);
    std::fprintf(stderr, "seed %zu\n", i + 1);
  });
  std::vector<double> chi2;
  int within = 0;
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(kUnknowns), square = sum, stated = sum, of_slopes = sum;
  for (const auto& s : found) {
    const Eigen::VectorXd off = s.step - truth, stddev = s.covariance.diagonal().cwiseSqrt();
    chi2.push_back(off.dot(SolveSymmetric(s.covariance, off).col(0)));
    within += static_cast<int>((off.array().abs() <= 2.0 * stddev.array()).count());
    sum += s.step, square += s.step.cwiseAbs2(), stated += stddev;
    of_slopes += s.slope_covariance.diagonal().cwiseSqrt();
  }
  std::printf("100 ln                 truth    mean +- error   scatter  stated  (of slopes)\n");
  for (int i = 0; i < kUnknowns; ++i) {
    const double mean = sum[i] / seeds,
                 scatter = std::sqrt(std::max(0.0, square[i] / seeds - mean * mean) * seeds / (seeds - 1.0));
    std::printf("%-20s %7.2f %7.2f +- %5.2f  %8.2f %7.2f  (%.2f)\n", kNames[i], 100 * truth[i], 100 * mean,
                100 * scatter / std::sqrt(seeds), 100 * scatter, 100 * stated[i] / seeds, 100 * of_slopes[i] / seeds);
  }
  // Kolmogorov and Smirnov against chi2 of 8 degrees: P = 1 - exp(-x/2) (1 + x/2 + (x/2)^2 / 2 + (x/2)^3 / 6).
  std::sort(chi2.begin(), chi2.end());
  double distance = 0;
  for (size_t i = 0; i < chi2.size(); ++i) {
    const double h = 0.5 * chi2[i], p = 1.0 - std::exp(-h) * (1.0 + h + h * h / 2.0 + h * h * h / 6.0);
    distance = std::max({distance, p - static_cast<double>(i) / seeds, (static_cast<double>(i) + 1.0) / seeds - p});
  }
  const double share = static_cast<double>(within) / (kUnknowns * seeds),
               critical = 1.628 / (std::sqrt(seeds) + 0.12 + 0.11 / std::sqrt(seeds));  // at 1 % (Stephens 1970)
  std::printf("within 2 standard deviations: %d of %d, %.1f %%\n", within, kUnknowns * seeds, 100 * share);
  std::printf("chi2 of 8: median %.1f (7.3), largest %.1f; Kolmogorov-Smirnov distance %.3f, at 1 %% below %.3f\n",
              chi2[chi2.size() / 2], chi2.back(), distance, critical);
  return share >= 0.93 && share <= 0.98 && distance < critical ? 0 : 1;
}
