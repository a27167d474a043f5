#include "dental/nearest_tabs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/random.h"
#include "photo/colour_difference.h"

namespace crownfit {
namespace {

glm::dvec3 Scatter(const glm::dvec3& stddev, uint64_t key) {
  return stddev * glm::dvec3(Gaussian(key, 0), Gaussian(key, 1), Gaussian(key, 2));
}

std::array<double, 2> Interval(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) { return values[std::lround(share * static_cast<double>(values.size() - 1))]; };
  return {at(0.025), at(0.975)};
}

struct Neighbour {
  const ShadeTab* tab;
  double de00;
  std::vector<double> draws;
};

}  // namespace

ColourSample ScatteredColour(const glm::dvec3& lab, const glm::dvec3& stddev, int draws, uint64_t seed) {
  ColourSample sample{lab, {}};
  for (int d = 0; d < draws; ++d) sample.draws.push_back(lab + Scatter(stddev, Key(seed, 0x636f6c6f7572ull, d)));
  return sample;
}

NearestTabs NearestTabsOf(const ColourSample& sample, const ShadeSet& set, int draws, uint64_t seed) {
  std::vector<Neighbour> all;
  for (size_t t = 0; t < set.tabs.size(); ++t) {
    const ShadeTab& tab = set.tabs[t];
    all.push_back({&tab, Ciede2000(sample.lab, tab.lab), {}});
    for (int d = 0; d < draws; ++d)
      all.back().draws.push_back(Ciede2000(sample.draws.empty() ? sample.lab : sample.draws[d],
                                           tab.lab + Scatter(tab.stddev, Key(seed, 0x746162ull, t, d))));
  }
  std::stable_sort(all.begin(), all.end(), [](const Neighbour& a, const Neighbour& b) { return a.de00 < b.de00; });
  all.resize(std::min<size_t>(all.size(), 3));

  NearestTabs nearest;
  if (all.size() > 1) {
    std::vector<double> gap;
    for (size_t d = 0; d < all[0].draws.size(); ++d) gap.push_back(all[1].draws[d] - all[0].draws[d]);
    const bool is_seen = all[1].de00 - all[0].de00 >= kPerceptible, is_sure = Interval(gap)[0] > 0;
    nearest.can_tell_first_from_second = is_seen && is_sure;
    const std::string two = all[0].tab->name + " and " + all[1].tab->name;
    if (!is_sure) nearest.verdict.push_back(two + " can't be told apart: their difference is within its uncertainty");
    if (!is_seen) nearest.verdict.push_back(two + " are too close to tell: their distances differ by less than 0.8");
  }
  if (all[0].de00 > kAcceptable)
    nearest.verdict.push_back("no tab is an acceptable match: the nearest is " + all[0].tab->name +
                              ", more than 1.8 away");
  for (const Neighbour& n : all) {
    const auto [low, high] = Interval(n.draws);
    nearest.tabs.push_back({n.tab->name, n.de00, low, high});
  }
  return nearest;
}

JsonValue NearestJson(const NearestTabs& nearest) {
  JsonValue::Array list;
  for (const NearTab& n : nearest.tabs)
    list.push_back(
        JsonValue::Object{{"name", n.name}, {"de00", n.de00}, {"interval95", std::vector<double>{n.low95, n.high95}}});
  return JsonValue::Object{{"nearest", list},
                           {"can_tell_first_from_second", nearest.can_tell_first_from_second},
                           {"verdict", nearest.verdict}};
}

}  // namespace crownfit
