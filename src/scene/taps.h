#pragma once
// The taps of a point of the crown: where a kernel's offsets meet its surface.

#include <optional>
#include <vector>

#include "scene/crown.h"

namespace crownfit {

/// Where a ray that starts inside the object leaves it. The fine surface has triangles that reach below a layer that
/// stands out (OuterSurface of build_crown.cpp); the ray meets these from their front and goes on.
std::optional<Hit> WayOut(const Crown& crown, const glm::dvec3& start, const glm::dvec3& direction);

/// Rays project the kernel's offsets from the tangent plane of a point to the fine surface, so that every tap of a
/// closed object finds a place. On this side, they start below the point at a depth equal to the offset's length, at
/// most half way through. On the other side, they run from the point itself to the offset on the far side of flat
/// layers `layers_mm` thick. On a plate both taps lie at their offset; where the object ends or bends before, they lie
/// on its side there. `tooth_goes_on`: below the cut of an open scan a tap sees what the point itself sees.
std::vector<Tap> CastTaps(const Crown& crown, const TapKernel& kernel, const glm::dvec3& position,
                          const glm::dvec3& normal, double layers_mm, bool tooth_goes_on);

}  // namespace crownfit
