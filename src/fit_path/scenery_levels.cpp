#include "fit_path/scenery_levels.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "fit_path/gather_walks.h"
#include "fit_path/walk_schedule.h"
#include "path/path_derivatives.h"

namespace crownfit {
namespace {

/// 1 where a photograph shows no part of the object nearby and may be used.
std::vector<uint8_t> PlacesBeside(const Photograph& photo, const PhotographCast& cast) {
  const int width = photo.linear.width, height = photo.linear.height, apart = 3 + std::max(width, height) / 64;
  std::vector<uint8_t> beside = photo.usable;
  for (const PixelCast& p : cast.pixels)
    for (int y = std::max(0, p.y - apart); y <= std::min(height - 1, p.y + apart); ++y)
      std::fill_n(beside.begin() + static_cast<std::ptrdiff_t>(y) * width + std::max(0, p.x - apart),
                  std::min(width - 1, p.x + apart) - std::max(0, p.x - apart) + 1, uint8_t{0});
  return beside;
}

/// Every n-th of them.
void Thin(size_t at_most, std::vector<uint8_t>& places) {
  const auto count = static_cast<size_t>(std::count(places.begin(), places.end(), 1));
  const size_t every = std::max<size_t>(1, count / at_most);
  size_t k = 0;
  for (uint8_t& place : places)
    if (place && k++ % every != 0) place = 0;
}

double Median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The median over blocks: shadows' edges and specks of dust are in few.
std::optional<SceneryLevel> LevelOf(const std::string& name, const Photograph& photo, double exposure,
                                    const std::vector<uint8_t>& beside, const PathPhotograph& walked) {
  constexpr size_t kFewBlocks = 6;
  constexpr double kCutOut = 0.05;  // of what is predicted: a picture whose background was taken away
  constexpr double kLit = 0.1;      // of the brightest: what no lamp reaches tells of noise and stray light alone
  constexpr double kOfGaussian = 1.4826, kOfMedian = 1.2533;  // stddev by the median deviation; the median's by that
  const int block = std::max(1, photo.linear.width / 24);
  struct Sums {
    Spectrum seen, predicted;
    double pixels = 0;
  };
  std::map<std::pair<int, int>, Sums> blocks;
  for (size_t k = 0; k < walked.rendered.size(); ++k) {
    const size_t place = walked.rendered[k];
    if (!beside[place]) continue;
    const int x = static_cast<int>(place) % photo.linear.width, y = static_cast<int>(place) / photo.linear.width;
    Sums& s = blocks[{x / block, y / block}];
    s.pixels += 1;
    s.predicted += exposure * walked.pixels[k].mean;
    s.seen += PixelOf(photo.linear, static_cast<size_t>(y) * photo.linear.width + x);
  }
  double brightest = 0;
  for (const auto& [at, s] : blocks) brightest = std::max(brightest, s.predicted.Middle() / s.pixels);
  SceneryLevel level;
  level.photograph = name;
  level.ratio = level.stddev = Spectrum(photo.linear.channels, 0.0);
  for (int c = 0; c < photo.linear.channels; ++c) {
    std::vector<double> ratios;
    for (const auto& [at, s] : blocks)
      if (s.predicted.Middle() > kLit * brightest * s.pixels && s.predicted[c] > 0 &&
          s.seen.Middle() > kCutOut * s.predicted.Middle())
        ratios.push_back(s.seen[c] / s.predicted[c]);
    if (ratios.size() < kFewBlocks) return std::nullopt;
    level.ratio[c] = Median(ratios);
    for (double& r : ratios) r = std::abs(r - level.ratio[c]);
    level.stddev[c] = kOfMedian * kOfGaussian * Median(ratios) / std::sqrt(static_cast<double>(ratios.size()));
  }
  return level;
}

/// Of a photograph's brightness, relative: of its exposure, and of the least well known one of its lamps, as stated or,
/// where they are free, as the fit found them. `found`: of the lights' intensities; empty where the fit does not tell.
double ErrorOfBrightness(const Capture& capture, const PhotographSpec& spec, const PhotographResult& result,
                         const std::vector<double>& found) {
  double of_lamp = 0;
  for (const size_t l : spec.lights) {
    const Light& light = capture.lights[l];
    const auto place = PlaceOf(light, spec.camera_from_object.Inverse());
    const double of_place = place ? 2.0 * light.Stddev_mm() / glm::length(*place) : 0.0;
    const double of_intensity = light.scale_is_free && !found.empty() ? found[l] : light.intensity_stddev;
    of_lamp = std::max(of_lamp, std::hypot(of_intensity / light.intensity_scale, of_place));
  }
  return std::hypot(
      spec.exposure_is_free ? result.exposure_stddev / result.exposure : spec.exposure_stddev / spec.exposure_scale,
      of_lamp);
}

}  // namespace

std::vector<SceneryLevel> SceneryLevelsOf(const FitProblem& problem, CrownInput& input, const FitState& at,
                                          const std::vector<PhotographResult>& results, Progress& progress) {
  constexpr size_t kPixels = 600;
  constexpr int kPaths = 64;  // a pixel
  const Capture before = input.capture;
  input.capture = problem.capture;
  for (size_t l = 0; l < input.capture.lights.size(); ++l)
    if (Light& light = input.capture.lights[l]; light.scale_is_free) light.intensity_scale = at.scales.light[l];
  const Material material = MaterialAt(problem.free, at.x);
  Bodies bodies(input, problem.options.threads);
  std::vector<std::vector<uint8_t>> beside(input.photographs.size());
  std::vector<size_t> photographs;
  for (size_t i = 0; i < beside.size(); ++i) {
    const PhotographSpec& spec = input.capture.photographs[i];
    if (at.cast.photographs[i].pixels.empty() || (!spec.backing && spec.scenery.empty())) continue;
    beside[i] = PlacesBeside(input.photographs[i], at.cast.photographs[i]);
    Thin(kPixels, beside[i]);
    if (std::count(beside[i].begin(), beside[i].end(), 1) > 0) photographs.push_back(i);
  }
  std::vector<SceneryLevel> levels;
  for (const std::vector<size_t>& shared : WhichShareWalks(input.capture, photographs)) {
    PathOptions options;
    std::vector<size_t> together;
    for (const size_t k : shared) {
      const std::vector<uint8_t>& places = beside[photographs[k]];
      together.push_back(photographs[k]);
      options.wanted.resize(places.size(), 0);
      for (size_t p = 0; p < places.size(); ++p) options.wanted[p] |= places[p];
    }
    options.paths_per_pixel = kPaths;
    options.seed = problem.options.seed;
    options.stream = Key(kFitStream, 1, together[0]);
    options.threads = problem.options.threads;
    const auto walked =
        RenderTogether(input.capture, bodies.Of(material), input.scenery, material, together, options,
                       [&](double share) { progress.Show("tile and scenery", share, results[together[0]].name); });
    for (size_t k = 0; k < together.size(); ++k) {
      const size_t i = together[k];
      const PhotographSpec& spec = input.capture.photographs[i];
      const double exposure = spec.exposure_is_free ? results[i].exposure : spec.exposure_scale;
      auto level = LevelOf(results[i].name, input.photographs[i], exposure, beside[i], walked[k]);
      if (!level) continue;
      level->stated = ErrorOfBrightness(input.capture, spec, results[i], at.knowledge.scales_stddev.light);
      if (spec.backing) level->shows.push_back(input.capture.backings[*spec.backing].name);
      for (const size_t s : spec.scenery) level->shows.push_back(input.capture.scenery[s].name);
      for (const size_t l : spec.lights) level->lights.push_back(input.capture.lights[l].name);
      levels.push_back(*level);
    }
  }
  input.capture = before;
  return levels;
}

}  // namespace crownfit
