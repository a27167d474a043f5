#pragma once
// One linear picture from a series of exposures, and the response of cameras that encode their pictures.

#include <array>
#include <optional>
#include <vector>

#include "calibration/product.h"
#include "photo/image_io.h"
#include "photo/photograph.h"

namespace crownfit {

struct ExposureSeries {
  std::vector<Image> photographs;  ///< linear, in the order of their times; full scale 1
  std::vector<double> times;       ///< ascending
  SensorNoise noise;               ///< black is subtracted
};

struct MergedExposures {
  Image linear;                ///< as in the shortest exposure: 1 saturates
  Image variance;              ///< of `linear`
  double share_saturated = 0;  ///< pixels saturated in the shortest exposure too: they keep its value
  /// Signal ratio of two neighbouring exposures over the ratio of their times, and the largest departure from 1. Uses
  /// pixels where the shorter exposure predicts 0.15 to half of saturation for the longer one; if there are none,
  /// pixels where the longer one shows that. One per neighbouring pair, absent where neither selects a pixel.
  std::vector<std::optional<double>> time_ratios;
  double worst_ratio = 0;
  double shift_px = 0;    ///< largest shift between two neighbouring exposures
  double saturation = 0;  ///< of `linear`: the lowest of its channels'
};

/// Weights every exposure by the inverse of its variance in the merged picture's units; leaves out saturated values.
MergedExposures MergeExposures(const ExposureSeries& series);

/// The inverse response of a camera that writes encoded 8-bit pictures: light at every value from 0 to 255 per channel,
/// 1 at 255 (Debevec and Malik 1997, by OpenCV).
std::vector<std::array<double, 3>> EstimateResponse(const std::vector<ImageFile>& photographs,
                                                    const std::vector<double>& times);

/// Pictures decoded by a response; others as they are.
Image Decoded(const Image& encoded, const std::vector<std::array<double, 3>>& response);

}  // namespace crownfit
