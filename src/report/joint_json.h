#pragma once
// What a fit knows of all its values at once, for material.json.

#include "base/json_file.h"
#include "fit/fit_result.h"

namespace crownfit {

/// {"names", "stddev", "correlation"} of everything that was free, photographs and priors together, in ln where values
/// are positive by nature. A power law's three values are three names, which two numbers move.
JsonValue JointJson(const CrownFit& fit);

}  // namespace crownfit
