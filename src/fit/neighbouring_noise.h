#pragma once
// The noise of a pixel, estimated from its neighbours.

#include <vector>

#include "fit/nuisances.h"
#include "scene/cast_samples.h"

namespace crownfit {

/// Standard deviations of the fitted pixels' noise. They come from the neighbours' `stated` variances, scaled by the
/// power of the predicted light that fits all variances. `light`: predictions in the order of FitPixels::values,
/// without noise of their own, in any unit.
///
/// A pixel's own stated variance correlates with the value it recorded, whether a camera's noise model or a renderer's
/// samples state it. Weights made from it count bright outliers less than dark ones, and pull the mean down (Mighell
/// 1999 for counted photons). The bias is the square of the relative noise for shot noise, and twice that and more
/// where a renderer's own samples state the variance. Variance pictures may be smoothed over 5 pixels (`crownfit
/// synthesize` does): neighbours closer than that include the pixel's own variance and are left out.
std::vector<Spectrum> NoiseOfNeighbours(const FitPixels& p, const PhotographCast& cast,
                                        const std::vector<Spectrum>& stated, const std::vector<Spectrum>& light);

/// Means over every pixel and its nearest neighbours, for a picture that has noise of its own.
std::vector<Spectrum> OverNearest(const FitPixels& p, const PhotographCast& cast, const std::vector<Spectrum>& values);

}  // namespace crownfit
