#include "plan/coarseness.h"

#include <algorithm>

namespace crownfit {

Coarseness Coarsen(CrownInput& input) {
  // Of all photographs together: pixels of the object, and triangles on which light is gathered.
  constexpr double kPixels = 60000, kTriangles = 240000;
  constexpr double kLeastUsable = 0.5;
  const double photographs = static_cast<double>(input.photographs.size());
  Coarseness coarse;
  coarse.cast.strata = coarse.cast.gather_strata = 3;
  coarse.cast.crown.simplifies = true;
  size_t& triangles = coarse.cast.crown.fine_triangles;
  triangles = std::min(triangles, static_cast<size_t>(kTriangles / photographs));
  for (size_t i = 0; i < input.photographs.size(); ++i) {
    const int side = AverageCrown(*input.source.meshes[0], kPixels / photographs, /*noise_is_known=*/true,
                                  input.capture.photographs[i], input.photographs[i], kLeastUsable);
    coarse.merged.push_back(static_cast<double>(side) * side);
  }
  return coarse;
}

}  // namespace crownfit
