#include "fit_path/predict_by_walks.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "base/parallel.h"
#include "capture/capture.h"
#include "fit/walk_comparison.h"
#include "fit_path/gather_walks.h"
#include "fit_path/walk_schedule.h"
#include "path/path_derivatives.h"

namespace crownfit {
namespace {

/// Where walks tell a photograph's values; index y * width + x.
using WalkedValues = std::vector<std::optional<Spectrum>>;

/// The values that walks gave, of every photograph with a cast: those of the fit have them already.
std::map<size_t, WalkedValues> WalkedPictures(const FitProblem& problem, const CrownInput& input, const FitState& at,
                                              Progress& progress) {
  const Capture& capture = input.capture;
  const auto pixels_of = [&](size_t photograph) {
    const Camera& camera = capture.photographs[photograph].camera;
    return static_cast<size_t>(camera.width) * camera.height;
  };
  const auto place_of = [&](size_t photograph, const PixelCast& p) {
    return static_cast<size_t>(p.y) * capture.photographs[photograph].camera.width + p.x;
  };
  std::map<size_t, WalkedValues> pictures;
  for (size_t g = 0; g < at.walked.size(); ++g) {
    const FitPixels& p = at.pixels[g];
    WalkedValues& values = pictures[p.photograph];
    values.resize(pixels_of(p.photograph));
    for (size_t i = 0; i < p.sources.size(); ++i)
      values[place_of(p.photograph, at.cast.photographs[p.photograph].pixels[p.sources[i]])] = at.walked[g][i];
  }
  std::vector<size_t> others;
  for (size_t i = 0; i < at.cast.photographs.size(); ++i)
    if (!pictures.count(i) && !at.cast.photographs[i].pixels.empty()) others.push_back(i);
  Bodies bodies(input, problem.options.threads);
  const Material material = MaterialAt(problem.free, at.x);
  for (const std::vector<size_t>& shared : WhichShareWalks(capture, others)) {
    std::vector<size_t> photographs;
    PathOptions options;
    options.wanted.assign(pixels_of(others[shared[0]]), 0);
    for (const size_t k : shared) {
      photographs.push_back(others[k]);
      for (const PixelCast& pixel : at.cast.photographs[others[k]].pixels)
        if (!pixel.at_silhouette) options.wanted[place_of(others[k], pixel)] = 1;
    }
    const auto pixels = std::count(options.wanted.begin(), options.wanted.end(), 1);
    const bool hands_over = problem.options.model == Model::kDiffusion;
    const double paths = std::min(static_cast<double>(problem.options.paths_per_photograph), kRun.values);
    options.paths_per_pixel = 1 + static_cast<int>(paths / static_cast<double>(std::max<long>(1, pixels)));
    options.collisions = problem.options.collisions;
    for (const size_t i : photographs)
      options.collisions = std::max(options.collisions, CollisionsThatDepolarise(capture.photographs[i]));
    if (hands_over) options.lattice = &bodies.LatticeOf(material);
    options.seed = problem.options.seed;
    options.stream = Key(kFitStream, 0, photographs[0]);
    options.threads = problem.options.threads;
    options.estimator = Estimator::kCollisions;
    const std::vector<PathPhotograph> walked = RenderTogether(
        capture, bodies.Of(material), input.scenery, material, photographs, options,
        [&](double share) { progress.Show("walking " + capture.photographs[photographs[0]].name, share); });
    for (size_t k = 0; k < photographs.size(); ++k) {
      WalkedValues& values = pictures[photographs[k]];
      values.resize(options.wanted.size());
      for (const PixelCast& pixel : at.cast.photographs[photographs[k]].pixels)
        if (const size_t place = place_of(photographs[k], pixel); !pixel.at_silhouette)
          values[place] = walked[k].pixels[walked[k].RankOf(place)].mean;
    }
  }
  return pictures;
}

/// One photograph: what walks gave, beside the cast's pixels.
class WalkedPhotograph {
 public:
  WalkedPhotograph(const Camera& camera, const PhotographCast& cast, const WalkedValues& walked)
      : cast_(cast), walked_(walked), width_(camera.width), height_(camera.height), pixel_at_(walked.size(), 0) {
    for (size_t k = 0; k < cast.pixels.size(); ++k) pixel_at_[PlaceOf(cast.pixels[k].x, cast.pixels[k].y)] = k;
  }

  const std::optional<Spectrum>& At(size_t k) const { return walked_[PlaceOf(cast_.pixels[k].x, cast_.pixels[k].y)]; }

  /// Calls visit(pixel of the cast, walked value, squared distance in pixels) for walked pixels around pixel k.
  template <typename Visit>
  void Around(size_t k, int reach, const Visit& visit) const {
    const PixelCast& pixel = cast_.pixels[k];
    for (int y = std::max(0, pixel.y - reach); y <= std::min(height_ - 1, pixel.y + reach); ++y)
      for (int x = std::max(0, pixel.x - reach); x <= std::min(width_ - 1, pixel.x + reach); ++x) {
        const size_t place = PlaceOf(x, y);
        const int dx = x - pixel.x, dy = y - pixel.y;
        if (walked_[place]) visit(pixel_at_[place], *walked_[place], dx * dx + dy * dy);
      }
  }

 private:
  size_t PlaceOf(int x, int y) const { return static_cast<size_t>(y) * width_ + x; }

  const PhotographCast& cast_;
  const WalkedValues& walked_;
  int width_, height_;
  std::vector<size_t> pixel_at_;  // of the cast, by place; where walks tell nothing it stands for none
};

constexpr int kReach = 4;  // pixels over which walks are averaged

/// Of a pixel's walked variance: what the mean over its neighbours has of it, and what it differs from that mean by.
struct ShareOfVariance {
  double mean = 0, apart = 0;
};

/// What `shader` shows, as bright as walks are around every pixel (their ratio over neighbours).
std::vector<ShareOfVariance> ScaleToWalks(const WalkedPhotograph& photograph, const std::vector<Spectrum>& shader,
                                          int threads, std::vector<Spectrum>& seen) {
  std::vector<ShareOfVariance> shares(seen.size());
  ParallelFor(seen.size(), threads, [&](size_t k) {
    Spectrum of_walks(seen[k].size(), 0.0), of_shader = of_walks;
    double weights = 0, squares = 0;
    photograph.Around(k, kReach, [&](size_t near, const Spectrum& walked, int distance2) {
      const double weight = std::exp(-0.5 * distance2 / kReach);
      of_walks += weight * walked;
      of_shader += weight * shader[near];
      weights += weight, squares += weight * weight;
    });
    for (int c = 0; c < of_shader.size(); ++c)
      if (of_shader[c] > 0) seen[k][c] *= of_walks[c] / of_shader[c];
    if (weights <= 0) return;
    shares[k].mean = squares / (weights * weights);
    shares[k].apart = 1.0 - 2.0 / weights + shares[k].mean;  // it is in its mean itself
  });
  return shares;
}

/// Variances of `seen`, from what walks around a pixel differ from it by.
std::vector<Spectrum> VariancesOfMeans(const WalkedPhotograph& photograph, const std::vector<Spectrum>& seen,
                                       const std::vector<ShareOfVariance>& shares, int threads) {
  std::vector<Spectrum> variances(seen.size());
  ParallelFor(seen.size(), threads, [&](size_t k) {
    double apart = 0;
    photograph.Around(k, kReach, [&](size_t near, const Spectrum& walked, int) {
      variances[k] += (walked - seen[near]) * (walked - seen[near]);
      apart += shares[near].apart;
    });
    if (apart > 0) variances[k] *= shares[k].mean / apart;
  });
  return variances;
}

/// Shader's detail may be wrong: of a lamp that a nearly smooth surface mirrors its few samples make dots. Walks stand
/// as they are where they are further from it than their noise, which most places show.
void LetWalksStand(const WalkedPhotograph& photograph, const std::vector<ShareOfVariance>& shares,
                   PredictedPixels& predicted) {
  constexpr int kPatchReach = 1;
  constexpr double kWrong = 4.0;  // times the usual square
  std::vector<Spectrum>& seen = predicted.values;
  std::vector<double> off(seen.size(), 0.0);
  for (size_t k = 0; k < seen.size(); ++k) {
    int count = 0;
    photograph.Around(k, kPatchReach, [&](size_t near, const Spectrum& walked, int) {
      off[k] += seen[near].Middle() > 0 ? std::pow(walked.Middle() / seen[near].Middle() - 1.0, 2) : 0.0;
      ++count;
    });
    if (count > 0) off[k] /= count;
  }
  std::vector<double> sorted = off;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double usual = sorted[sorted.size() / 2];
  for (size_t k = 0; k < seen.size(); ++k) {
    if (!photograph.At(k) || off[k] <= kWrong * usual) continue;
    seen[k] = *photograph.At(k);
    if (shares[k].mean > 0) predicted.variances[k] /= shares[k].mean;
  }
}

}  // namespace

Predictor PredictorByWalks(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress) {
  auto pictures = std::make_shared<const std::map<size_t, WalkedValues>>(WalkedPictures(problem, input, at, progress));
  return [&problem, &input, &at, pictures](size_t photograph) {
    const PhotographCast& cast = at.cast.photographs[photograph];
    const int threads = problem.options.threads;
    const std::vector<Spectrum> shader =
        PredictPixels(input.capture, at.cast, photograph, MaterialAt(problem.free, at.x), at.scales.light, threads);
    PredictedPixels predicted{shader};
    if (cast.pixels.empty()) return predicted;
    const WalkedPhotograph walked(input.capture.photographs[photograph].camera, cast, pictures->at(photograph));
    const std::vector<ShareOfVariance> shares = ScaleToWalks(walked, shader, threads, predicted.values);
    predicted.variances = VariancesOfMeans(walked, predicted.values, shares, threads);
    LetWalksStand(walked, shares, predicted);
    return predicted;
  };
}

}  // namespace crownfit
