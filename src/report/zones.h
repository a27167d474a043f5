#pragma once
// Differences between a prediction and its photograph by thirds of the crown, in a technician's words.

#include <string>
#include <vector>

#include "fit/fit_result.h"

namespace crownfit {

struct ZoneDifference {
  std::string zone;             ///< cervical, middle, incisal
  ColourDifference difference;  ///< with the brightness scale of the whole photograph
  glm::dvec3 off_lab{0.0};      ///< L*, a*, b* of the prediction's mean colour less the photograph's
  double off_de00 = 0;          ///< CIEDE2000 between the mean colours
};

/// The thirds that contain compared pixels, from the neck to the edge; empty where the crown's ends are unknown.
std::vector<ZoneDifference> ZonesOf(const PhotographResult& photograph);

/// "lighter, a little redder": words for every axis of more than half a unit (three such make about the threshold of
/// perception, 0.8). "alike" when there is none.
std::string DifferenceWords(const glm::dvec3& off_lab);

}  // namespace crownfit
