#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "base/parallel.h"
#include "fit/walk_comparison.h"
#include "fit_by_walks.h"
#include "gather_walks.h"
#include "path_derivatives.h"

namespace crownfit {
namespace {

/// Where walks tell a photograph's values; index y * width + x.
using WalkedValues = std::vector<std::optional<glm::dvec3>>;

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
    const bool hands_over = problem.options.model == "diffusion";
    const double paths = static_cast<double>(problem.options.paths_per_photograph) * (hands_over ? kOfHandedOver : 1.0);
    options.paths_per_pixel = 1 + static_cast<int>(paths / static_cast<double>(std::max<long>(1, pixels)));
    options.collisions = problem.options.collisions;
    for (const size_t i : photographs)
      options.collisions = std::max(options.collisions, CollisionsThatDepolarise(capture.photographs[i]));
    if (hands_over) options.lattice = &bodies.LatticeOf(material);
    options.seed = problem.options.seed;
    options.stream = Key(kFitStream, 0, photographs[0]);
    options.threads = problem.options.threads;
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

}  // namespace

Predictor PredictorByWalks(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress) {
  auto pictures = std::make_shared<const std::map<size_t, WalkedValues>>(WalkedPictures(problem, input, at, progress));
  return [&problem, &input, &at, pictures](size_t photograph) {
    constexpr int kReach = 4;  // pixels over which the ratio is averaged
    const PhotographCast& cast = at.cast.photographs[photograph];
    const Camera& camera = input.capture.photographs[photograph].camera;
    const std::vector<glm::dvec3> shader = PredictPixels(
        input.capture, at.cast, photograph, MaterialAt(problem.free, at.x), at.scales.light, problem.options.threads);
    if (cast.pixels.empty()) return PredictedPixels{shader};
    const WalkedValues& walked = pictures->at(photograph);
    std::vector<size_t> pixel_at(walked.size(), shader.size());  // of the cast; none: their number
    for (size_t k = 0; k < shader.size(); ++k)
      pixel_at[static_cast<size_t>(cast.pixels[k].y) * camera.width + cast.pixels[k].x] = k;
    /// Calls visit(place, squared distance in pixels) for walked pixels around one.
    const auto around = [&](const PixelCast& pixel, int reach, const auto& visit) {
      for (int y = std::max(0, pixel.y - reach); y <= std::min(camera.height - 1, pixel.y + reach); ++y)
        for (int x = std::max(0, pixel.x - reach); x <= std::min(camera.width - 1, pixel.x + reach); ++x) {
          const size_t place = static_cast<size_t>(y) * camera.width + x;
          const int dx = x - pixel.x, dy = y - pixel.y;
          if (walked[place]) visit(place, dx * dx + dy * dy);
        }
    };
    std::vector<glm::dvec3> seen = shader;
    // Of walks' variance: what the mean over neighbours leaves, and what a pixel differs from it by.
    std::vector<double> left(seen.size(), 0.0), apart(seen.size(), 0.0);
    ParallelFor(seen.size(), problem.options.threads, [&](size_t k) {
      const PixelCast& pixel = cast.pixels[k];
      glm::dvec3 of_walks(0.0), of_shader(0.0);
      double weights = 0, squares = 0;
      around(pixel, kReach, [&](size_t place, int distance2) {
        const double weight = std::exp(-0.5 * distance2 / kReach);
        of_walks += weight * *walked[place];
        of_shader += weight * shader[pixel_at[place]];
        weights += weight, squares += weight * weight;
      });
      for (int c = 0; c < kChannels; ++c)
        if (of_shader[c] > 0) seen[k][c] *= of_walks[c] / of_shader[c];
      if (weights <= 0) return;
      left[k] = squares / (weights * weights);
      apart[k] = 1.0 - 2.0 / weights + left[k];  // it is in its mean itself
    });
    std::vector<glm::dvec3> variances(seen.size(), glm::dvec3(0.0));
    ParallelFor(seen.size(), problem.options.threads, [&](size_t k) {
      double of_walks = 0;
      around(cast.pixels[k], kReach, [&](size_t place, int) {
        const size_t near = pixel_at[place];
        const glm::dvec3 off = *walked[place] - seen[near];
        variances[k] += off * off;
        of_walks += apart[near];
      });
      if (of_walks > 0) variances[k] *= left[k] / of_walks;
    });
    // Shader's detail may be wrong: of a lamp that a nearly smooth surface mirrors its few samples make dots. Walks
    // stand as they are where they are further from it than their noise, which most places show.
    constexpr int kPatchReach = 1;
    constexpr double kWrong = 4.0;  // times the usual square
    std::vector<double> off(seen.size(), 0.0);
    for (size_t k = 0; k < seen.size(); ++k) {
      int count = 0;
      around(cast.pixels[k], kPatchReach, [&](size_t place, int) {
        const double there = seen[pixel_at[place]].y;
        off[k] += there > 0 ? std::pow(walked[place]->y / there - 1.0, 2) : 0.0;
        ++count;
      });
      if (count > 0) off[k] /= count;
    }
    std::vector<double> sorted = off;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    const double usual = sorted[sorted.size() / 2];
    for (size_t k = 0; k < seen.size(); ++k) {
      const auto& here = walked[static_cast<size_t>(cast.pixels[k].y) * camera.width + cast.pixels[k].x];
      if (!here || off[k] <= kWrong * usual) continue;
      seen[k] = *here;
      if (left[k] > 0) variances[k] /= left[k];
    }
    return PredictedPixels{seen, variances};
  };
}

}  // namespace crownfit
