#pragma once
// How many walks the stages of a fit take.

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace crownfit {

inline constexpr uint64_t kFitStream = 0x6669747365656bull;  ///< no photograph's synthesis is keyed by it
// Of the paths that are asked for: what walks of model diffusion tell as much by, what a search walks handed over, and
// what to their end.
inline constexpr double kOfHandedOver = 0.2, kSearchShare = 0.1, kMiddleShare = 0.4;
/// Of a photograph, for a search: every pixel takes its walks (FewestPaths), and derivatives three times as many.
inline constexpr size_t kPixelsOfSearch = 2500;

/// Beside so many paths for values in a long run, for derivatives, of which those of several runs are averaged. By a
/// fifth of the fewest, a small tooth's tell a third as much.
inline double SlopePaths(double paths) {
  constexpr double kShare = 0.3, kMostShare = 1.5, kFewest = 300000.0;
  return std::max(kShare * paths, std::min(kFewest, kMostShare * paths));
}

}  // namespace crownfit
