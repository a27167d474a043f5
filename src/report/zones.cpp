#include "report/zones.h"

#include <array>
#include <cmath>

namespace crownfit {

std::vector<ZoneDifference> ZonesOf(const PhotographResult& p) {
  std::vector<ZoneDifference> zones;
  if (p.thirds.empty()) return zones;
  const double scale = ComparisonScale(p.photograph, p.compared, p.rgb_from_sensor);
  constexpr std::array<const char*, 3> kNames{"cervical", "middle", "incisal"};
  for (size_t third = 1; third <= kNames.size(); ++third) {
    std::vector<uint8_t> mask(p.thirds.size());
    for (size_t i = 0; i < mask.size(); ++i) mask[i] = p.thirds[i] == third;
    ZoneDifference zone{kNames[third - 1], ComparePictures(p.photograph, p.prediction, mask, p.rgb_from_sensor, scale)};
    if (zone.difference.pixels == 0) continue;
    zone.off_lab = zone.difference.prediction_lab - zone.difference.photograph_lab;
    zone.off_de00 = Ciede2000(zone.difference.photograph_lab, zone.difference.prediction_lab);
    zones.push_back(zone);
  }
  return zones;
}

std::string DifferenceWords(const glm::dvec3& off_lab) {
  constexpr double kAlike = 0.5, kLittle = 2.0, kMuch = 5.0;
  constexpr std::array<std::array<const char*, 2>, 3> kWords{
      {{"lighter", "darker"}, {"redder", "greener"}, {"yellower", "bluer"}}};
  std::string words;
  for (int axis = 0; axis < 3; ++axis) {
    const double off = std::abs(off_lab[axis]);
    if (off <= kAlike) continue;
    words += std::string(words.empty() ? "" : ", ") +
             (off <= kLittle ? "a little "
              : off > kMuch  ? "much "
                             : "") +
             kWords[axis][off_lab[axis] > 0 ? 0 : 1];
  }
  return words.empty() ? "alike" : words;
}

}  // namespace crownfit
