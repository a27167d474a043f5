#pragma once
// Builds a crown from its layers, ready for ray casts.

#include <memory>
#include <vector>

#include "scene/crown.h"
#include "scene/crown_source.h"

namespace crownfit {

/// The nested surfaces of BuildSurfaces, with everything on which the shader model casts; `kernel`: its blur kernel.
std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness, int threads,
                                        const TapKernel& kernel = ConvergedKernel());

}  // namespace crownfit
