#pragma once
// Photon transfer (Janesick 2007): gain, read noise, black level and saturation of a camera from pairs of photographs
// of one still scene and from dark frames.

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "photo/image.h"

namespace crownfit {

/// Noise of one channel, in units of its values (full scale is 1).
struct ChannelNoise {
  double gain = 0, read_noise = 0, black = 0;  ///< variance = gain x (value - black) + read_noise^2
  double gain_stddev = 0, read_noise_stddev = 0, black_stddev = 0;
  std::optional<double> saturation;  ///< where the response departs from its line by 1 %, or where values pile up
  double chi2 = 0;                   ///< per degree of freedom, of the variances about the fitted line
  bool settled = true;               ///< whether the weighted line converged
  double nonlinearity = 0;  ///< largest relative departure below saturation; measured with unequal exposures only
  double hidden_black = 0;  ///< black level that the variances suggest where no dark frames were given; approximate
  double shift_px = 0;      ///< largest shift between two photographs of a pair
  std::vector<glm::dvec3> points;  ///< value, variance at that value, standard deviation of the variance
};

/// The photographs of a pair may differ in exposure: their ratio is estimated. Values are linear. Darks: frames without
/// light. Absent when fewer than two levels can be distinguished.
std::optional<ChannelNoise> EstimateChannelNoise(const std::vector<std::pair<const Image*, const Image*>>& pairs,
                                                 const std::vector<const Image*>& darks, int channel);

}  // namespace crownfit
