#pragma once
// The channels of tests' scenes and captures.

#include <cmath>

#include "photo/spectrum.h"

namespace crownfit {

/// Red, green and blue.
inline constexpr int kChannels = 3;

/// Length of the difference as a vector.
inline double Distance(const Spectrum& a, const Spectrum& b) { return std::sqrt((a - b).Dot(a - b)); }

}  // namespace crownfit
