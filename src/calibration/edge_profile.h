#pragma once
// Exact position of a blurred edge.

#include <glm/glm.hpp>
#include <optional>

#include "photo/image.h"

namespace crownfit {

struct EdgePlace {
  double offset_px;  ///< along `outward` from the given position
  double stddev_px;
};

/// Fits an edge to a profile across it, averaged over five pixels along it and over all channels. The object's side may
/// darken towards its rim, so the model has a level and a slope inside, a level outside and a Gaussian blur. Unlike a
/// threshold, it has no bias towards the brighter side. Absent where the profile leaves the picture, or has no edge
/// within `reach_px`.
std::optional<EdgePlace> StepAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                    double blur_px, double reach_px);

/// The blur, of several, that fits the profile best; absent where there is none.
std::optional<double> BlurAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                 double reach_px);

}  // namespace crownfit
