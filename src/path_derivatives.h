#pragma once
// A photograph by walks with its derivatives by scattering, absorption, g, index, thickness and roughness.

#include "base/progress.h"
#include "fit_steps.h"
#include "walk/picture_slopes.h"

namespace crownfit {

struct DifferentiatedPhotograph {
  PathPhotograph photo;
  PooledSlopes slopes;
};

/// By scattering, absorption and g from the paths themselves; by the layers' thickness and index and the surface's
/// roughness from pictures with those changed and the same random numbers (thickness by +-20 % and the parabola through
/// three: smaller steps have ten times the noise and no less bias).
/// `body`: as the material's thicknesses shape it.
DifferentiatedPhotograph DifferentiateByPaths(const CrownInput& input, const LayeredBody& body,
                                              const Material& material, size_t photograph, const PathOptions& options,
                                              Progress& progress);

/// "enamel.absorption_per_mm", "surface.roughness".
std::string NameOf(const SlopeParameter& parameter, const Material& material);

}  // namespace crownfit
