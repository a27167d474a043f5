#pragma once
// Filters before lamps and camera, and their effect on polarised light.

#include <cmath>

namespace crownfit {

enum class Polarisation { kNone, kCross, kParallel };

/// Signal from light S that kept its polarisation and depolarised light D: none = S + D, cross = D, parallel = 2 S + D.
/// Photographs are normalised to a white card seen through the filters.
struct Polarisers {
  double of_kept;        ///< factor on S
  double memory_events;  ///< a fraction exp(-n / this) of light that was scattered n times is S; 0: none is

  static Polarisers Of(Polarisation polarisation, double memory_events = 0) {
    return {polarisation == Polarisation::kNone    ? 1.0
            : polarisation == Polarisation::kCross ? 0.0
                                                   : 2.0,
            memory_events};
  }
  /// Factor on light that layers scattered `events` times and nothing else has depolarised.
  template <class T>
  T OfScattered(const T& events) const {
    using std::exp;
    return memory_events > 0 ? 1.0 + (of_kept - 1.0) * exp(-events / memory_events) : T(1.0);
  }
};

}  // namespace crownfit
