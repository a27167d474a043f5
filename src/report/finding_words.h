#pragma once
// Findings of a fit as sentences.

#include <string>
#include <vector>

#include "fit/finding.h"
#include "fit/fit_result.h"

namespace crownfit {

std::string InWords(const Finding& finding);
std::vector<std::string> InWords(const std::vector<Finding>& findings);

/// What the photographs determine, what they do not, and what counts as exact.
std::string VerdictInWords(const CrownFit& fit);

/// "a, b and c".
std::string Listed(const std::vector<std::string>& names);

}  // namespace crownfit
