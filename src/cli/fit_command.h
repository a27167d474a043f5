#pragma once
// `crownfit fit`, as far as `batch` needs it.

#include <string>
#include <vector>

namespace crownfit {

/// What `crownfit fit CAPTURE -o RESULT` would complain of with these arguments, or nothing.
std::string FaultOfFit(const std::vector<std::string>& fit_arguments);

}  // namespace crownfit
