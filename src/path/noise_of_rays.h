#pragma once
// What a pixel's paths say of the noise of the uncollided light that they all see.

#include <array>
#include <vector>

#include "path/pixel_estimate.h"
#include "path/uncollided_light.h"

namespace crownfit {

/// A two-way analysis of variance of what paths found of each group of rays. The rays' noise is the same for all paths
/// and pixels. The paths' noise is independent of it, but both together make a third part, the interaction, which is in
/// the scatter of paths and in that of groups of rays alike and must be counted once.
class NoiseOfRays {
 public:
  using OfGroups = std::array<double, UncollidedLight::kGroups>;
  explicit NoiseOfRays(int channels) : of_channel_(static_cast<size_t>(channels)) {}

  /// One path: per channel, as many times what each group found as there are groups.
  void Add(const std::vector<OfGroups>& path);

  /// The covariance of the mean of all paths, whose own scatter is `by_paths`. Moves the means of groups of paths as
  /// far apart as both noises make them: group g also by as much as what the rays of group g found is off the mean, or
  /// those of several.
  ChannelCovariance Include(const PixelEstimate& by_paths, size_t groups, Spectrum* group_means) const;

 private:
  struct OfChannel {
    OfGroups sum{};
    double squares = 0, squares_of_paths = 0;
  };
  std::vector<OfChannel> of_channel_;
  double paths_ = 0;
};

}  // namespace crownfit
