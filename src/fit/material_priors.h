#pragma once
// What an earlier fit, or a class of materials, says of the free entries: --prior.

#include <filesystem>

#include "fit/free_parameters.h"

namespace crownfit {

/// Takes mean and standard deviation of every free entry from what a material file states with a standard deviation, in
/// ln for what is fitted in ln; what it does not state so keeps its prior. Throws InputError when it states none.
void TakePriors(const std::filesystem::path& file, const Capture& capture, FreeParameters& free);

}  // namespace crownfit
