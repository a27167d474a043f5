#pragma once
// Flat layered samples by the same random walk that renders crowns. Comparing them with independent programs tests the
// walk itself.

#include <functional>
#include <glm/glm.hpp>
#include <optional>

#include "base/random.h"
#include "optics/slab.h"
#include "path/slab_lanes.h"

namespace crownfit {

struct SlabWalkOptions {
  uint64_t photons = 1000000, seed = 1;
  int threads = 0;
  int lanes = 128;  ///< most photons side by side; affects only the time
};

/// Totals with standard errors, and ring means where the slab states radii. `photons` arrive at normal incidence at one
/// point, and a quarter as many diffusely.
SlabAnswer SolveByWalks(const Slab& slab, const SlabWalkOptions& options, const std::function<void(double)>& progress);

/// Standard error of the mean of `n` values, from their sum and the sum of their squares.
double StandardError(double sum, double square, double n);

std::vector<FlatLayer> FlatLayersOf(const Slab& slab);

/// A photon just inside the first layer.
struct EnteredPhoton {
  glm::dvec3 direction;
  RandomStream random;
};

/// Empty where the first surface reflects it; `specular`: the probability of that at normal incidence.
std::optional<EnteredPhoton> EnterSlab(const Slab& slab, double specular, bool is_diffuse, uint64_t key);

}  // namespace crownfit
