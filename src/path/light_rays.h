#pragma once
// Light from a photograph's lamps as it enters the object, before diffusion takes over: the source of the diffuse light
// inside.

#include <functional>
#include <vector>

#include "diffusion/volume_lattice.h"
#include "path/path_context.h"

namespace crownfit {

/// A short piece of a ray inside the object.
struct LightStep {
  LatticePlace middle;
  float length_mm;
  int16_t medium;
  bool is_reduced;   ///< of the last flight, by the reduced coefficient; its scattering is the diffuse source
  bool collides;     ///< the step ends in a collision
  uint32_t carried;  ///< index of its power in LightRays::carried
};

struct LightRay {
  size_t first_step, steps;
  int hero;   ///< the channel whose scattering drew its flights
  int piece;  ///< boundary piece that it left as diffuse light, per unit of power leaving there; -1: from a lamp
};

struct LightRays {
  std::vector<LightRay> rays;
  std::vector<LightStep> steps;
  SpectrumArray<> carried;  ///< power of a flight, before attenuation by the media since the ray first entered
  void Append(LightRays&& more) {
    for (LightRay& ray : more.rays) ray.first_step += steps.size(), rays.push_back(ray);
    for (LightStep& step : more.steps) step.carried += static_cast<uint32_t>(carried.size());
    carried.Append(more.carried);
    steps.insert(steps.end(), more.steps.begin(), more.steps.end());
    more = {};
  }
  void Clear() { rays.clear(), steps.clear(), carried.clear(); }
};

/// How light is followed from the lamps before diffusion takes over.
struct Lighting {
  int collisions = 10;  ///< of the true random walk, per ray
  int rays = 40000;     ///< per lamp, over the whole surface; 1 to 2 % of noise per square millimetre
  double least = 1e-3;  ///< share of its initial power at which a ray ends
};

/// Traces one of the context's photographs. Points evenly spaced over the surface receive light of each lamp from a
/// random point on it, and of the surroundings from a random direction. `take` receives those rays in batches. The
/// points also emit diffuse light in a random direction; rays that come back are returned. Inside, a ray scatters as
/// often as `lighting` states, as in the true random walk. Its last flight uses the reduced coefficient and is followed
/// in full: its remaining power is known at every step. Handles the points of `part` of `parts`.
LightRays TraceLight(const PathContext& context, const VolumeLattice& lattice, size_t photograph,
                     const Lighting& lighting, uint64_t seed, size_t part, size_t parts,
                     const std::function<void(const LightRays&)>& take);

}  // namespace crownfit
