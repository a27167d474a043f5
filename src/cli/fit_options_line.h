#pragma once
// Options of a fit. `batch` takes them for all crowns, a manifest for each.

#include <optional>
#include <string>
#include <vector>

#include "cli/common_options.h"
#include "fit/fit_options.h"

namespace crownfit {

/// A fit's options as parsed.
struct FitText {
  FitOptions fit;
  std::vector<std::string> fixes, shares;  ///< NAME=VALUE, NAME=LAW
  std::optional<size_t> walks;
  bool no_priors = false;
};

/// Options shared by `fit` and `batch`: each may be a column of a manifest.
std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, FitText& options);

/// Converts the text. Throws InputError naming the option.
FitOptions FitOptionsOf(const FitText& text);

}  // namespace crownfit
