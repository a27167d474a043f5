#pragma once
// A coarse copy of a fit's input, from which a fit of many photographs is foreseen in seconds.

#include <vector>

#include "scene/cast_samples.h"
#include "scene/crown_input.h"

namespace crownfit {

/// By how much a copy is coarser than what a fit works on.
struct Coarseness {
  CastOptions cast;
  std::vector<double> merged = {};  ///< per photograph: pixels of the fit's picture in one of the copy; empty: one

  double Merged(size_t photograph) const { return merged.empty() ? 1.0 : merged[photograph]; }
};

/// Averages photographs over squares of pixels where they show more of the object than a forecast needs, and says how
/// finely a forecast casts. The more photographs, the coarser each. A capture of few small photographs stays as
/// it is. Noise is averaged as independent noise is.
Coarseness Coarsen(CrownInput& input);

}  // namespace crownfit
