#pragma once
// Mean and covariance of a pixel's samples, over its channels.

#include <algorithm>
#include <vector>

#include "photo/spectrum.h"

namespace crownfit {

/// Upper triangle of a covariance between channels, row by row: of three RR RG RB GG GB BB.
using ChannelCovariance = std::vector<double>;
/// Index of a pair of channels, in either order.
inline size_t PairOf(int a, int b, int channels) {
  const int low = std::min(a, b), high = std::max(a, b);
  return static_cast<size_t>(low * channels - low * (low - 1) / 2 + high - low);
}

/// Mean of a pixel and the covariance of that mean.
struct PixelEstimate {
  Spectrum mean;
  ChannelCovariance covariance;
  bool on_object = false;  ///< the ray through the pixel's centre hits the object
  Spectrum variance() const {
    Spectrum own = mean;
    for (int c = 0; c < own.size(); ++c) own[c] = covariance[PairOf(c, c, own.size())];
    return own;
  }
};

/// Sums of independent samples.
struct PixelSum {
  Spectrum sum;
  ChannelCovariance square;
  explicit PixelSum(int channels) : sum(channels, 0.0), square(static_cast<size_t>(channels * (channels + 1) / 2)) {}
  void Add(const Spectrum& x) {
    sum += x;
    size_t k = 0;
    for (int a = 0; a < sum.size(); ++a)
      for (int b = a; b < sum.size(); ++b) square[k++] += x[a] * x[b];
  }
  PixelEstimate Estimate(int samples) const {
    PixelEstimate e;
    const double n = samples;
    e.mean = sum / n;
    e.covariance.resize(square.size());
    size_t k = 0;
    for (int a = 0; a < sum.size(); ++a)
      for (int b = a; b < sum.size(); ++b, ++k) {
        e.covariance[k] = samples > 1 ? (square[k] / n - e.mean[a] * e.mean[b]) / (n - 1.0) : 0.0;
        if (a == b) e.covariance[k] = std::max(0.0, e.covariance[k]);  // against rounding, where all paths are alike
      }
    return e;
  }
};

}  // namespace crownfit
