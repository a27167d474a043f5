#pragma once
// Photons between flat layers side by side, as arrays, so that vector instructions compute several at once. Every
// lane's arithmetic is its own, so results depend neither on the number of lanes nor on the instruction set.

#include <array>
#include <cstdint>
#include <span>

#include "base/random.h"

namespace crownfit {

/// A flat layer as light inside sees it; z points up.
struct FlatLayer {
  double top_mm, bottom_mm;
  double free_path_mm;  ///< kNoCollision in a clear layer
  double absorption_per_mm;
  double g, isotropic_fraction;
  double ior_above, ior_below;  ///< relative to the layer's own

  static constexpr double kNoCollision = 1e300;
};

struct SlabLanes {
  static constexpr int kMax = 128;
  /// Beyond this optical depth of absorption one photon in four survives, with four times the weight.
  static constexpr double kDeep = 3.5;
  static constexpr int kLiveOfDeep = 4;
  template <class T>
  using Lanes = std::array<T, kMax>;
  /// Any other value: the roulette ended the photon.
  enum Fate : uint64_t { kCollided = 0, kMeetsBoundary = 4 };

  alignas(64) Lanes<double> x, y, z, dx, dy, dz;  ///< place and direction
  alignas(64) Lanes<double> depth;                ///< optical depth of absorption: light left is exp(-depth)
  alignas(64) Lanes<uint64_t> random, random_step;
  alignas(64) Lanes<double> top_mm, bottom_mm, free_path_mm, absorption_per_mm, g;
  alignas(64) Lanes<double> isotropic, per_isotropic, per_other;  ///< share of it, one over it, one over the rest
  alignas(64) Lanes<double> ior_above, ior_below;
  alignas(64) Lanes<uint64_t> fate;        ///< set by Fly
  alignas(64) Lanes<uint64_t> has_passed;  ///< set by Cross

  void Enter(int lane, const FlatLayer& layer);
  /// One flight and collision of lanes [0, count); lanes whose flight ends at a boundary stay in place. Lanes up to the
  /// next multiple of 8 are computed too, and ignored.
  void Fly(int count);
  /// Moves lanes to the boundary that they meet, and samples reflection or transmission by Fresnel.
  void Cross(std::span<const int> lanes);
  void Copy(int from, int to);
};

}  // namespace crownfit
