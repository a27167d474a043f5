#pragma once
// Covariance matrices in files.

#include <vector>

#include "base/json_file.h"

namespace crownfit {

/// `size` rows of `size` numbers, row by row. Refuses a matrix that is not symmetric, or has a correlation beyond 1.
std::vector<double> ReadCovariance(const JsonNode& node, size_t size);

}  // namespace crownfit
