#pragma once
// How well a place is known, as files state it.

#include <vector>

#include "base/json_file.h"

namespace crownfit {

/// `size` rows of `size` numbers, row by row. Refuses what is no covariance: not symmetric, or a correlation beyond 1.
std::vector<double> ReadCovariance(const JsonNode& node, size_t size);

}  // namespace crownfit
