#pragma once
// Flat layered samples by the `shader` model: the diffusing layers that it assumes below every point of a crown.

#include "optics/slab.h"

namespace crownfit {

/// Totals only, no rings. A beam with its own direction represents collimated light; the 45-degree beam of shading
/// represents diffuse light. Accurate to some per cent where layers are thick and scatter far more than they absorb
/// (docs/forward_model.md). The transmittance of clear thin layers has larger errors.
SlabAnswer SolveByShader(const Slab& slab);

}  // namespace crownfit
