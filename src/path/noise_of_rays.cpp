#include "path/noise_of_rays.h"

#include <algorithm>
#include <cmath>

namespace crownfit {

void NoiseOfRays::Add(const std::vector<OfGroups>& path) {
  for (size_t c = 0; c < of_channel_.size(); ++c) {
    OfChannel& to = of_channel_[c];
    double all = 0;
    for (size_t j = 0; j < path[c].size(); ++j) {
      to.sum[j] += path[c][j];
      to.squares += path[c][j] * path[c][j];
      all += path[c][j];
    }
    to.squares_of_paths += all * all / static_cast<double>(path[c].size());
  }
  ++paths_;
}

ChannelCovariance NoiseOfRays::Include(const PixelEstimate& by_paths, size_t groups, Spectrum* group_means) const {
  constexpr auto kRays = static_cast<size_t>(UncollidedLight::kGroups);
  const auto channels = static_cast<int>(of_channel_.size());
  Spectrum reduced(channels, 1.0);
  std::array<Spectrum, kRays> found;
  found.fill(Spectrum(channels, 0.0));
  for (int c = 0; c < channels; ++c) {
    const OfChannel& of = of_channel_[static_cast<size_t>(c)];
    double all = 0, squares_of_rays = 0;
    for (size_t j = 0; j < kRays; ++j) {
      found[j][c] = of.sum[j] / paths_;
      all += of.sum[j];
      squares_of_rays += of.sum[j] * of.sum[j] / paths_;
    }
    const double cells = paths_ * kRays, of_paths = by_paths.covariance[PairOf(c, c, channels)],
                 residual = of.squares - of.squares_of_paths - squares_of_rays + all * all / cells;
    if (paths_ < 2 || !(of_paths > 0)) continue;
    const double interaction = residual / ((paths_ - 1.0) * (kRays - 1.0) * cells);
    reduced[c] = std::sqrt(1.0 - std::clamp(interaction / of_paths, 0.0, 1.0));
  }
  PixelSum rays(channels);
  for (const Spectrum& of_group : found) rays.Add(of_group);
  const PixelEstimate by_rays = rays.Estimate(static_cast<int>(kRays));
  for (size_t g = 0; g < groups; ++g) {
    Spectrum of_rays;
    double count = 0;
    for (size_t j = g; j < kRays; j += groups, ++count) of_rays += found[j];
    group_means[g] = by_paths.mean + reduced * (group_means[g] - by_paths.mean) + of_rays / count - by_rays.mean;
  }
  ChannelCovariance covariance = by_rays.covariance;
  for (int a = 0; a < channels; ++a)
    for (int b = a; b < channels; ++b)
      covariance[PairOf(a, b, channels)] += reduced[a] * reduced[b] * by_paths.covariance[PairOf(a, b, channels)];
  return covariance;
}

}  // namespace crownfit
