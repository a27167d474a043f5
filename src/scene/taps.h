#pragma once
// The taps of a point of the crown: where a kernel's offsets meet its surface.

#include <vector>

#include "scene/crown.h"

namespace crownfit {

/// The kernel's offsets in the tangent plane of a point of the fine surface, brought to the surface by rays, so that
/// every tap of a closed object finds a place: on this side from a point as far below as the offset is long, at most
/// half way through; on the other side from the point itself to the offset on the far side of flat layers `layers_mm`
/// thick. On a plate both are at their offset; where the object ends or bends before, they are on the side that it has
/// there. `tooth_goes_on`: below the cut of an open scan a tap sees what the point itself sees.
std::vector<Tap> CastTaps(const Crown& crown, const TapKernel& kernel, const glm::dvec3& position,
                          const glm::dvec3& normal, double layers_mm, bool tooth_goes_on);

}  // namespace crownfit
