#pragma once
// Priors of the free entries, from an earlier fit or for a class of materials: --prior.

#include <filesystem>

#include "fit/free_parameters.h"

namespace crownfit {

/// Takes mean and standard deviation of every free entry from a material file, where the file states a standard
/// deviation; in ln for what is fitted in ln. Other entries keep their prior. Throws InputError when it states none.
void TakePriors(const std::filesystem::path& file, const Capture& capture, FreeParameters& free);

}  // namespace crownfit
