#pragma once
// Where exactly a blurred edge stands.

#include <glm/glm.hpp>
#include <optional>

#include "photo/image.h"

namespace crownfit {

struct EdgePlace {
  double offset_px;  ///< along `outward` from the given place
  double stddev_px;
};

/// A profile across an edge: averaged over five pixels along it, all channels together. The side that is the object may
/// grow darker towards its rim, so a model with a level and a slope inside, a level outside and a Gaussian blur is
/// fitted to it, not a threshold: nothing pulls it towards the brighter side. Absent where the profile leaves the
/// picture, or has no edge within `reach_px`.
std::optional<EdgePlace> StepAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                    double blur_px, double reach_px);

/// The blur, of several, that explains the profile best; absent where there is none.
std::optional<double> BlurAcross(const Image& image, const glm::dvec2& pixel, const glm::dvec2& outward,
                                 double reach_px);

}  // namespace crownfit
