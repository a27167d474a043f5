#pragma once
// The part of `crownfit fit` that `batch` needs.

#include <filesystem>
#include <string>
#include <vector>

namespace crownfit {

/// What `crownfit fit CAPTURE -o RESULT` would complain of with these arguments, or nothing. `capture`: what they say
/// of its parameters is checked too; empty: not.
std::string FaultOfFit(const std::vector<std::string>& fit_arguments, const std::filesystem::path& capture);

}  // namespace crownfit
