#pragma once
// How noisy a pixel is, from its neighbours.

#include <vector>

#include "fit/nuisances.h"
#include "scene/cast_samples.h"

namespace crownfit {

/// Standard deviations of the fitted pixels' noise: their neighbours' `stated` variances, scaled by the power with
/// which all go up with the light that is predicted of them and of the pixel (`light`, as FitPixels::values and without
/// their noise; any unit).
///
/// What a pixel's own variance is stated to be goes up and down with what it happened to record, whether a camera's
/// noise model or a renderer's samples state it. Weights made of it count bright accidents less than dark ones, and
/// pull the mean down (Mighell 1999 of counted photons): by the square of the relative noise where it is shot noise, by
/// twice that and more where a renderer's own samples state it. Variance pictures may be smoothed over 5 pixels
/// (`crownfit synthesize` does): neighbours nearer than that hold the pixel's own and are left out.
std::vector<glm::dvec3> NoiseOfNeighbours(const FitPixels& p, const PhotographCast& cast,
                                          const std::vector<glm::dvec3>& stated, const std::vector<glm::dvec3>& light);

/// Means over every pixel and its nearest few: of a picture that has noise of its own.
std::vector<glm::dvec3> OverNearest(const FitPixels& p, const PhotographCast& cast,
                                    const std::vector<glm::dvec3>& values);

}  // namespace crownfit
