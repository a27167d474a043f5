#include "fit/neighbouring_noise.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace crownfit {

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
