#pragma once
// Flat layered samples by the `diffusion` model (docs/diffusion_model.md): light takes K true collisions and one flight
// with the reduced coefficient. Diffusion follows, which has a closed form in flat layers.

#include <functional>
#include <vector>

#include "optics/slab.h"
#include "path/slab_lanes.h"

namespace crownfit {

/// Shares of diffuse light from a point inside that leave upwards and downwards: the adjoint solutions of
/// -(n^2 D u')' + n^2 sa u = 0 with n^2 u / (2 A) leaving at either face. Exact elements, one per layer.
class FlatEscape {
 public:
  struct Shares {
    double up, down;
  };
  explicit FlatEscape(const std::vector<FlatLayer>& layers);
  /// `height_mm`: above the layer's bottom.
  Shares From(size_t layer, double height_mm) const;

 private:
  std::vector<double> thickness_mm_, decay_;  ///< per layer; decay: the root of sa / D, 1/mm
  std::vector<Shares> at_;                    ///< per interface, topmost first
};

struct SlabDiffusionOptions {
  uint64_t photons = 1000000, seed = 1;
  int threads = 0;
  int collisions = 10;
};

/// Totals with the standard errors of the random-walk part; no rings. `photons` arrive at normal incidence, a quarter
/// as many diffusely, and as many from below where there is a backing.
SlabAnswer SolveByDiffusion(const Slab& slab, const SlabDiffusionOptions& options,
                            const std::function<void(double)>& progress);

}  // namespace crownfit
