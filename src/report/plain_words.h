#pragma once
// The verdict for who reads one paragraph.

#include <string>
#include <vector>

#include "fit/fit_result.h"

namespace crownfit {

struct PlainVerdict {
  std::string headline;                ///< whether to use the result
  std::vector<std::string> sentences;  ///< how near the picture is, how sure the parameters are, what is not known
  std::vector<std::string> photographs_that_would_help;
};

/// Pairs of parameters that the photographs hardly tell apart, the closest first: a sentence each.
std::vector<std::string> ExchangesInWords(const CrownFit& fit);

PlainVerdict PlainVerdictOf(const CrownFit& fit);

}  // namespace crownfit
