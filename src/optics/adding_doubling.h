#pragma once
// The `layered` model: flat layers, uniformly lit, by adding and doubling (van de Hulst 1980; Grant and Hunt 1969),
// with an index step at every boundary. Exact but for the number of directions; no lateral transport. Eigen is named in
// adding_doubling.cpp only.

#include "optics/slab.h"

namespace crownfit {

struct AddingDoublingOptions {
  int nodes = 24;  ///< directions per group of refractive indices, in a hemisphere: 12 reach 1e-4, 24 reach 3e-5
};

/// Totals of a slab, without the first surface's mirror reflection. Any Slab has an answer; rings have none.
SlabAnswer SolveByAddingDoubling(const Slab& slab, const AddingDoublingOptions& options = {});

}  // namespace crownfit
