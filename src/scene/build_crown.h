#pragma once
// A crown built from its layers, ready to be cast on.

#include <memory>
#include <vector>

#include "scene/crown.h"
#include "scene/crown_source.h"

namespace crownfit {

/// The nested surfaces of BuildSurfaces, with all that the shader model casts on; `kernel`: by which it blurs.
std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness, int threads,
                                        const TapKernel& kernel = ConvergedKernel());

}  // namespace crownfit
