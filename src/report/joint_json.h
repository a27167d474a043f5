#pragma once
// The joint distribution of all fitted values, for material.json.

#include "base/json_file.h"
#include "fit/fit_result.h"

namespace crownfit {

/// {"names", "stddev", "correlation"} of everything that was free, from photographs and priors together, in ln where
/// values are always positive. A power law has three names, one per channel, but only two free parameters.
JsonValue JointJson(const CrownFit& fit);

}  // namespace crownfit
