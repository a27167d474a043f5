#pragma once
// The verdict for who reads one paragraph.

#include <string>
#include <vector>

#include "report/crown_fit.h"

namespace crownfit {

struct PlainVerdict {
  std::string headline;                ///< whether to use the result
  std::vector<std::string> sentences;  ///< how near the picture is, how sure the parameters are, what is not known
  std::vector<std::string> photographs_that_would_help;
};

PlainVerdict PlainVerdictOf(const CrownFit& fit);

}  // namespace crownfit
