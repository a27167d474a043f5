#pragma once
// Colour differences between photographs: CIEDE2000 under D65, 2 degree observer, with the dental thresholds.

#include <optional>
#include <vector>

#include "photo/colour.h"
#include "photo/image.h"

namespace crownfit {

inline constexpr double kPerceptible = 0.8;  ///< ISO/TR 28642: half of observers see the difference
inline constexpr double kAcceptable = 1.8;   ///< half of observers accept it

struct ColourDifference {
  double median = 0, p95 = 0, mean = 0, share_below_pt = 0, share_below_at = 0;  ///< over means of 8 x 8 pixel blocks
  double pixel_median = 0, pixel_p95 = 0;
  size_t pixels = 0, blocks = 0;
  glm::dvec3 photograph_lab{0.0}, prediction_lab{0.0};  ///< of the mean colours
  Image map;  ///< 1 channel: from means over the 8 x 8 pixels around each; negative where nothing was compared
};

/// Compares two linear pictures where `mask` is set. Both are scaled by `scale`, or so that the 95th percentile of the
/// first one's luminance is 0.6. `rgb_from_sensor` turns both into linear sRGB first.
ColourDifference ComparePictures(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                                 const ColourTransform& rgb_from_sensor = {}, std::optional<double> scale = {});

/// The scale that ComparePictures uses.
double ComparisonScale(const Image& photograph, const std::vector<uint8_t>& mask,
                       const ColourTransform& rgb_from_sensor);

}  // namespace crownfit
