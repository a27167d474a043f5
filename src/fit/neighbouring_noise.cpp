#include "fit/neighbouring_noise.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace crownfit {
namespace {

/// By which power of the light variances go: 0 read noise, 1 shot noise, 2 a share of the light (and most renderers').
/// Slope of their logarithms over all pixels; 1 where all are equally bright.
glm::dvec3 PowerOfLight(const std::vector<glm::dvec3>& stddev, const std::vector<glm::dvec3>& brightness) {
  glm::dvec3 power(1.0);
  for (int c = 0; c < kChannels; ++c) {
    double count = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < stddev.size(); ++i) {
      if (!(stddev[i][c] > 0.0)) continue;
      const double light = std::log(brightness[i][c]), variance = 2.0 * std::log(stddev[i][c]);
      count += 1.0, x += light, y += variance, xx += light * light, xy += light * variance;
    }
    const double spread = xx - x * x / count;
    if (spread > 1e-6 * count) power[c] = std::clamp((xy - x * y / count) / spread, 0.0, 2.0);
  }
  return power;
}

}  // namespace

std::vector<glm::dvec3> NoiseOfNeighbours(const FitPixels& p, const PhotographCast& cast,
                                          const std::vector<glm::dvec3>& predicted) {
  constexpr int kSmoothed = 5, kFurthest = 80;  // pixels; further away where a fit takes but every n-th
  constexpr size_t kFewest = 8;
  constexpr double kDark = 1e-3;  // of the mean
  std::vector<glm::dvec3> brightness = p.scenery;
  brightness.resize(p.pixels.size(), glm::dvec3(0.0));
  glm::dvec3 floor(1e-12);
  for (size_t i = 0; i < brightness.size(); ++i) {
    for (int t = p.first_term[i]; t < p.first_term[i + 1]; ++t)
      brightness[i] += static_cast<double>(p.terms[t].weight) * predicted[p.sources[p.terms[t].source]];
    floor += kDark / static_cast<double>(brightness.size()) * glm::abs(brightness[i]);
  }
  for (glm::dvec3& v : brightness) v = glm::max(v, floor);
  const glm::dvec3 power = PowerOfLight(p.stddev, brightness);
  for (glm::dvec3& v : brightness) v = glm::pow(v, power);  // what the variance goes with
  std::map<std::pair<int, int>, size_t> fitted_at;
  for (size_t i = 0; i < p.pixels.size(); ++i) fitted_at[{cast.pixels[p.pixels[i]].y, cast.pixels[p.pixels[i]].x}] = i;

  std::vector<glm::dvec3> stddev = p.stddev;
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    const PixelCast& here = cast.pixels[p.pixels[i]];
    // Of the ring around what it may have entered; on something smaller of all but the pixel.
    const auto of_ring = [&](int gap, int reach) {
      glm::dvec3 variance(0.0), light(0.0);
      size_t count = 0;
      for (int y = here.y - reach; y <= here.y + reach; ++y)
        for (auto near = fitted_at.lower_bound({y, here.x - reach});
             near != fitted_at.end() && near->first.first == y && near->first.second <= here.x + reach; ++near) {
          const size_t j = near->second;
          if (std::max(std::abs(y - here.y), std::abs(near->first.second - here.x)) <= gap) continue;
          variance += p.stddev[j] * p.stddev[j], light += brightness[j], ++count;
        }
      if (count >= kFewest) stddev[i] = glm::sqrt(variance / light * brightness[i]);
      return count >= kFewest;
    };
    bool is_found = false;
    for (const int gap : {kSmoothed, 0})
      for (int reach = 2 * kSmoothed; !is_found && reach <= kFurthest; reach *= 2) is_found = of_ring(gap, reach);
  }
  return stddev;
}

}  // namespace crownfit
