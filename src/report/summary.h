#pragma once
// A fit's result for the terminal.

#include <string>

#include "fit/fit_result.h"

namespace crownfit {

/// The result in a page of text.
std::string Summary(const CrownFit& fit);

}  // namespace crownfit
