#pragma once
// Options of a fit, which `batch` takes for all crowns and a manifest for each.

#include <optional>
#include <string>
#include <vector>

#include "cli/common_options.h"
#include "fit/fit_options.h"

namespace crownfit {

/// A fit's options as they are parsed.
struct FitText {
  FitOptions fit;
  std::vector<std::string> fixes, shares;  ///< NAME=VALUE, NAME=LAW
  std::optional<size_t> walks;
  bool no_priors = false;
};

/// What `fit` and `batch` share: every one of these may be a column of a manifest.
std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, FitText& options);

/// Throws InputError naming the option.
FitOptions FitOptionsOf(const FitText& text);

}  // namespace crownfit
