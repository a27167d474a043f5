#pragma once
// The pixels that a fit uses, and the sharp pixels that make up each of them.

#include <span>
#include <string>
#include <vector>

#include "fit/nuisances.h"
#include "scene/cast_capture.h"
#include "scene/cast_samples.h"
#include "scene/crown_input.h"

namespace crownfit {

/// Inside the mask and not saturated.
bool IsUsable(const Photograph& photo, const PixelCast& pixel);

/// Variance of a photograph's pixel, with that of the unknown surroundings beyond an open scan's neck.
Spectrum VarianceAt(const Photograph& photo, const PixelCast& pixel);

/// Photographs that share one fitted exposure have the same group.
std::string ExposureGroup(const PhotographSpec& spec);

/// Indices into the cast's pixels: usable ones whose square lies on the object, out of reach of its rim's blur.
std::vector<int> ComparablePixels(const PhotographSpec& spec, const PhotographCast& cast, const Photograph& photo,
                                  int threads);

/// Pixels for the fit: comparable ones, of every n-th row and column when there are more than `max_pixels`. Holdouts
/// are left out. Throws InputError when a photograph has none.
std::vector<FitPixels> ChoosePixels(const CrownInput& input, const CastState& state, size_t max_pixels);

/// The same photograph with only these of its pixels (indices into FitPixels::pixels).
FitPixels Subset(const FitPixels& pixels, std::span<const int> which);

}  // namespace crownfit
