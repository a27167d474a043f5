#pragma once
// Flat layered samples by the model `shader`: the diffusing layers that it puts below every point of a crown.

#include "optics/slab.h"

namespace crownfit {

/// Totals; no rings. A beam of its own direction stands for collimated light, the one at 45 degrees that shading uses
/// for diffuse light. Within some per cent where layers are thick and scatter far more than they absorb
/// (docs/forward_model.md); what clear thin layers pass is off by more.
SlabAnswer SolveByShader(const Slab& slab);

}  // namespace crownfit
