#pragma once
// Flights and collisions of many walks side by side, as arrays, so that vector instructions compute several at once.
// Every lane's arithmetic is its own, so results depend neither on the number of lanes nor on the instruction set.

#include <array>
#include <cstdint>

#include "base/random.h"
#include "path/medium.h"
#include "path/walk_scene.h"

namespace crownfit {

struct FlightLanes {
  static constexpr int kMax = 128;
  template <class T>
  using Lanes = std::array<T, kMax>;

  alignas(64) Lanes<double> x, y, z, dx, dy, dz;  ///< place and direction
  alignas(64) Lanes<uint64_t> random, random_step;
  alignas(64) Lanes<double> free_path_mm;  ///< of the medium, in the walk's channel
  alignas(64) Lanes<double> g, isotropic_fraction;
  alignas(64) Lanes<double> needs_search;    ///< 1: every flight needs a search (a clear or textured medium)
  alignas(64) Lanes<double> flight_mm;       ///< drawn by Fly
  alignas(64) Lanes<double> length_mm;       ///< path length in this medium
  alignas(64) Lanes<double> collisions;      ///< in this medium
  alignas(64) Lanes<double> until_roulette;  ///< collisions until the roulette
  alignas(64) Lanes<double> turn_cosine;     ///< cosine of the last scattering angle
  alignas(64) Lanes<double> phase_score;     ///< sum of d ln(phase function) / d g in this medium, by ScorePhase
  alignas(64) Lanes<double> collides;  ///< 1: the flight ended in a collision. Fly sets 0 where facets must be searched

  /// Samples a flight for lanes [0, count), and moves the lanes whose flights the distances prove free.
  void Fly(const TriangleGrid& grid, int count);
  /// Scatters the lanes that collide.
  void Scatter(int count);
  /// Adds the last collisions' derivatives of ln(phase function) by g.
  void ScorePhase(int count);
  void Copy(int from, int to);
};

}  // namespace crownfit
