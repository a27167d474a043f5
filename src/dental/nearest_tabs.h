#pragma once
// The laboratory's shade tabs nearest to a colour, and whether their order is certain.

#include <string>
#include <vector>

#include "base/json_file.h"
#include "dental/shades_file.h"

namespace crownfit {

/// A colour, with draws from its uncertainty.
struct ColourSample {
  glm::dvec3 lab;
  std::vector<glm::dvec3> draws;  ///< empty: it is exact
};
ColourSample ScatteredColour(const glm::dvec3& lab, const glm::dvec3& stddev, int draws, uint64_t seed);

struct NearTab {
  std::string name;
  double de00, low95, high95;
};
struct NearestTabs {
  std::vector<NearTab> tabs;  ///< at most three, the nearest first
  /// The first is nearer than the second in 97.5 % of the draws, and by a perceptible difference.
  bool can_tell_first_from_second = true;
  std::vector<std::string> verdict;  ///< which of these must not be trusted, in sentences
};
NearestTabs NearestTabsOf(const ColourSample& sample, const ShadeSet& set, int draws, uint64_t seed);

JsonValue NearestJson(const NearestTabs& nearest);

}  // namespace crownfit
