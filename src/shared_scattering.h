#pragma once
// Whether a layer's scattering may follow a law over the channels that has a number less.

#include <functional>
#include <string>
#include <vector>

#include "calibration/capture.h"
#include "fit/uncertainty.h"

namespace crownfit {

/// Of one law over the channels, beside the next that has a number more: a power law beside a value in each channel,
/// one value beside a power law. Departures are shares of the value, in the channel that departs most. Every fitted
/// value has the smaller mean square error under the law where the material departs from it by less than `told`
/// (Toro-Vizcarrondo and Wallace 1968, of one restriction on a linear regression).
struct SharedScattering {
  std::string parameter;  ///< "dentine.reduced_scattering_per_mm"
  Sharing law;
  bool is_stated;    ///< the capture states it; else what has a number more
  double told;       ///< a departure's standard deviation, where it is left free
  double published;  ///< by how much published teeth depart
  double narrows;    ///< under the law the interval of `narrowed` is narrower by this factor, the largest of all
  std::string narrowed;
  bool IsAdvised() const { return told > published; }
};

/// At the capture's start values. Of absorptions no law is known, so they are not asked about. `foresee`: what would be
/// known of the free entries of such a capture.
std::vector<SharedScattering> ScatteringThatMayBeShared(
    const Capture& capture, const std::function<DataKnowledge(const Capture&, const FreeParameters&)>& foresee);

}  // namespace crownfit
