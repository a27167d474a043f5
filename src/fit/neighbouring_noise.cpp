#include "fit/neighbouring_noise.h"

#include <algorithm>
#include <cmath>

#include "capture/parameters.h"

namespace crownfit {
namespace {

/// Exponent of the variance as a power of the light: 0 read noise, 1 shot noise, 2 a share of the light (and most
/// renderers'). Slope of their logarithms over all pixels; 1 where all are equally bright.
Spectrum PowerOfLight(const std::vector<Spectrum>& stddev, const std::vector<Spectrum>& brightness) {
  Spectrum power(stddev.empty() ? 1 : stddev[0].size(), 1.0);
  for (int c = 0; c < power.size(); ++c) {
    double count = 0, x = 0, y = 0, xx = 0, xy = 0;
    for (size_t i = 0; i < stddev.size(); ++i) {
      if (!(stddev[i][c] > 0.0)) continue;
      const double light = std::log(brightness[i][c]), variance = 2.0 * std::log(stddev[i][c]);
      count += 1.0, x += light, y += variance, xx += light * light, xy += light * variance;
    }
    const double spread = xx - x * x / count;
    if (spread > 1e-6 * count) power[c] = std::clamp((xy - x * y / count) / spread, 0.0, 2.0);
  }
  return power;
}

/// Fitted pixels by position.
class FittedAt {
 public:
  FittedAt(const FitPixels& p, const PhotographCast& cast) {
    for (const int k : p.pixels)
      right_ = std::max(right_, cast.pixels[k].x), bottom_ = std::max(bottom_, cast.pixels[k].y);
    at_.assign((static_cast<size_t>(right_) + 1) * (static_cast<size_t>(bottom_) + 1), kNone);
    for (size_t i = 0; i < p.pixels.size(); ++i)
      at_[PlaceOf(cast.pixels[p.pixels[i]].x, cast.pixels[p.pixels[i]].y)] = static_cast<int>(i);
  }
  /// Calls visit(pixel) for pixels more than `gap` and at most `reach` pixels away; returns their number.
  template <class Visit>
  size_t Around(const PixelCast& here, int gap, int reach, const Visit& visit) const {
    size_t count = 0;
    for (int y = std::max(0, here.y - reach); y <= std::min(bottom_, here.y + reach); ++y)
      for (int x = std::max(0, here.x - reach); x <= std::min(right_, here.x + reach); ++x) {
        const int near = at_[PlaceOf(x, y)];
        if (near == kNone || std::max(std::abs(y - here.y), std::abs(x - here.x)) <= gap) continue;
        visit(static_cast<size_t>(near)), ++count;
      }
    return count;
  }

 private:
  static constexpr int kNone = -1;
  size_t PlaceOf(int x, int y) const { return static_cast<size_t>(y) * (static_cast<size_t>(right_) + 1) + x; }
  int right_ = 0, bottom_ = 0;
  std::vector<int> at_;
};

}  // namespace

std::vector<Spectrum> NoiseOfNeighbours(const FitPixels& p, const PhotographCast& cast,
                                        const std::vector<Spectrum>& stated, const std::vector<Spectrum>& light) {
  constexpr int kSmoothed = 5, kFurthest = 80;  // pixels; further away where a fit uses only every n-th
  constexpr size_t kFewest = 8;
  constexpr double kDark = 1e-3;  // of the mean
  std::vector<Spectrum> brightness = light;
  Spectrum floor(1e-12);
  for (const Spectrum& v : light) floor += kDark / static_cast<double>(light.size()) * Abs(v);
  for (Spectrum& v : brightness) v = Max(v, floor);
  const Spectrum power = PowerOfLight(stated, brightness);
  for (Spectrum& v : brightness)
    for (int c = 0; c < v.size(); ++c) v[c] = std::pow(v[c], power[c]);  // proportional to the variance

  const FittedAt fitted(p, cast);
  std::vector<Spectrum> stddev = stated;
  for (size_t i = 0; i < p.pixels.size(); ++i) {
    // From the ring outside the smoothing width; on smaller objects from all pixels but this one.
    const auto of_ring = [&](int gap, int reach) {
      Spectrum variance(0.0), around(0.0);
      const size_t count = fitted.Around(cast.pixels[p.pixels[i]], gap, reach,
                                         [&](size_t j) { variance += stated[j] * stated[j], around += brightness[j]; });
      if (count >= kFewest) stddev[i] = Sqrt(variance / around * brightness[i]);
      return count >= kFewest;
    };
    bool is_found = false;
    for (const int gap : {kSmoothed, 0})
      for (int reach = 2 * kSmoothed; !is_found && reach <= kFurthest; reach *= 2) is_found = of_ring(gap, reach);
  }
  return stddev;
}

std::vector<Spectrum> OverNearest(const FitPixels& p, const PhotographCast& cast, const std::vector<Spectrum>& values) {
  constexpr size_t kFew = 5;
  constexpr int kFurthest = 4;
  const FittedAt fitted(p, cast);
  std::vector<Spectrum> means = values;
  for (size_t i = 0; i < means.size(); ++i) {
    size_t count = 0;
    for (int reach = 1; count < kFew && reach <= kFurthest; ++reach) {
      Spectrum sum(0.0);
      count = fitted.Around(cast.pixels[p.pixels[i]], -1, reach, [&](size_t j) { sum += values[j]; });
      means[i] = sum / static_cast<double>(count);
    }
  }
  return means;
}

}  // namespace crownfit
