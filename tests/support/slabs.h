#pragma once
// Short constructors of flat layered samples.

#include <utility>

#include "optics/slab.h"

namespace crownfit {

inline SlabLayer Tissue(double absorption, double scattering, double g, double ior, double mm) {
  return {ior, g, 0.0, scattering, absorption, mm};
}
inline Slab Of(std::vector<SlabLayer> layers) {
  Slab slab;
  slab.layers = std::move(layers);
  return slab;
}

}  // namespace crownfit
