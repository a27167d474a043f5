#pragma once
// The verdict as one short paragraph.

#include <string>
#include <vector>

#include "fit/fit_result.h"

namespace crownfit {

struct PlainVerdict {
  std::string headline;                ///< whether to use the result
  std::vector<std::string> sentences;  ///< how near the picture is, how well the parameters are known, what is unknown
  std::vector<std::string> photographs_that_would_help;
};

/// Pairs of parameters that the photographs hardly separate, the closest first: a sentence each.
std::vector<std::string> ExchangesInWords(const CrownFit& fit);

/// "Raising enamel absorption while lowering dentine absorption fits almost as well."
std::string InWords(const WeakDirection& direction);
/// Each as a vector: "+0.83 ln enamel.absorption_per_mm -0.51 ... (standard deviation 0.4)".
std::vector<std::string> AsVectors(const std::vector<WeakDirection>& directions);

PlainVerdict PlainVerdictOf(const CrownFit& fit);

}  // namespace crownfit
