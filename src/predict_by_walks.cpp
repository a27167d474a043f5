#include <algorithm>
#include <cmath>
#include <optional>

#include "base/parallel.h"
#include "fit/walk_comparison.h"
#include "fit_by_walks.h"
#include "path_derivatives.h"

namespace crownfit {

Predictor PredictorByWalks(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress) {
  return [&problem, &input, &at, &progress](size_t photograph) {
    constexpr int kReach = 4;  // pixels over which the ratio is averaged
    const Material material = MaterialAt(problem.free, at.x);
    const PhotographCast& cast = at.cast.photographs[photograph];
    const Camera& camera = input.capture.photographs[photograph].camera;
    std::vector<glm::dvec3> values =
        PredictPixels(input.capture, at.cast, photograph, material, at.scales.light, problem.options.threads);
    const auto place_of = [&](const PixelCast& pixel) { return static_cast<size_t>(pixel.y) * camera.width + pixel.x; };
    struct Pair {
      glm::dvec3 walked, shader;
    };
    std::vector<std::optional<Pair>> pairs(static_cast<size_t>(camera.width) * camera.height);
    const auto fitted = std::find_if(at.pixels.begin(), at.pixels.end(),
                                     [&](const FitPixels& p) { return p.photograph == photograph; });
    if (fitted != at.pixels.end() && !at.walked.empty()) {
      const auto& of_runs = at.walked[fitted - at.pixels.begin()];
      for (size_t i = 0; i < fitted->sources.size(); ++i) {
        const int k = fitted->sources[i];
        pairs[place_of(cast.pixels[k])] = Pair{of_runs[i], values[k]};
      }
    } else {
      PathOptions options;
      options.wanted.assign(pairs.size(), 0);
      for (const PixelCast& pixel : cast.pixels)
        if (!pixel.at_silhouette) options.wanted[place_of(pixel)] = 1;
      const double pixels = static_cast<double>(std::max<size_t>(1, cast.pixels.size()));
      options.paths_per_pixel =
          1 + static_cast<int>(static_cast<double>(problem.options.paths_per_photograph) / pixels);
      options.seed = problem.options.seed;
      options.stream = Key(kFitStream, 0, photograph);
      options.threads = problem.options.threads;
      Bodies bodies(input, problem.options.threads);
      const PathPhotograph walked = RenderByPaths(
          input.capture, bodies.Of(material), input.scenery, material, photograph, options,
          [&](double share) { progress.Show("walking " + input.capture.photographs[photograph].name, share); });
      for (size_t k = 0; k < values.size(); ++k)
        if (const size_t place = place_of(cast.pixels[k]); options.wanted[place])
          pairs[place] = Pair{walked.pixels[place].mean, values[k]};
    }
    std::vector<glm::dvec3> seen = values;
    ParallelFor(values.size(), problem.options.threads, [&](size_t k) {
      const PixelCast& pixel = cast.pixels[k];
      glm::dvec3 of_walks(0.0), of_shader(0.0);
      for (int y = std::max(0, pixel.y - kReach); y <= std::min(camera.height - 1, pixel.y + kReach); ++y)
        for (int x = std::max(0, pixel.x - kReach); x <= std::min(camera.width - 1, pixel.x + kReach); ++x) {
          const auto& pair = pairs[static_cast<size_t>(y) * camera.width + x];
          if (!pair) continue;
          const int dx = x - pixel.x, dy = y - pixel.y;
          const double weight = std::exp(-0.5 * (dx * dx + dy * dy) / kReach);
          of_walks += weight * pair->walked;
          of_shader += weight * pair->shader;
        }
      for (int c = 0; c < kChannels; ++c)
        if (of_shader[c] > 0) seen[k][c] *= of_walks[c] / of_shader[c];
    });
    return seen;
  };
}

}  // namespace crownfit
