#pragma once
// Light from a photograph's lamps as it enters the object and goes on without being scattered: the source of the
// diffuse light inside.

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
  bool is_reduced;    ///< of the last flight, by the reduced coefficient, whose scattering is diffusion's source
  bool collides;      ///< at its end
  glm::vec3 carried;  ///< power per channel, but for what the media took since the ray entered the first time
};

struct LightRay {
  size_t first_step, steps;
  int hero;   ///< the channel whose scattering drew its flights
  int piece;  ///< of the lattice's boundary, that it left as diffuse light: per power that leaves there; -1: of a lamp
};

struct LightRays {
  std::vector<LightRay> rays;
  std::vector<LightStep> steps;
  void Append(LightRays&& more) {
    for (LightRay& ray : more.rays) ray.first_step += steps.size(), rays.push_back(ray);
    steps.insert(steps.end(), more.steps.begin(), more.steps.end());
    more = {};
  }
  void Clear() { rays.clear(), steps.clear(); }
};

/// How light is followed from the lamps before diffusion takes over.
struct Lighting {
  int collisions = 10;  ///< of the true random walk
  int rays = 40000;     ///< of each lamp, over the whole surface; 1 to 2 % of noise a square millimetre
  double least = 1e-3;  ///< of a ray's power: where it ends
};

/// Of one of the context's photographs. Places evenly over the surface get light of each lamp from a random point of
/// it, and of what stands around from a random direction: `take` gets those rays, some at a time. Places also send
/// diffuse light out in a random direction, which is returned where it comes back. Inside, a ray is scattered so many
/// times as in the true random walk; what comes after it flies on by the reduced coefficient, in full: all that is left
/// of it is known at every step. Of places `part` of `parts`.
LightRays TraceLight(const PathContext& context, const VolumeLattice& lattice, size_t photograph,
                     const Lighting& lighting, uint64_t seed, size_t part, size_t parts,
                     const std::function<void(const LightRays&)>& take);

}  // namespace crownfit
