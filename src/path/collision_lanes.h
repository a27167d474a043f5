#pragma once
// Collisions of many walks side by side, which look for uncollided light where they are.

#include "path/camera_path.h"
#include "path/flight_lanes.h"
#include "path/uncollided_light.h"

namespace crownfit {

class CollisionLanes {
 public:
  /// Must outlive it.
  explicit CollisionLanes(const PathContext& context) : context_(context), media_(context.media) {}

  /// Call where flights of a lane begin.
  void Open(int lane, const CameraPath& path);
  void Move(int from, int to);

  /// Adds the lamps' light to the paths of those lanes whose flights ended in a collision. `path_of(lane)`: the path.
  template <class PathOf>
  void Score(const FlightLanes& flights, int count, const PathOf& path_of) {
    Weigh(flights, count);
    ScoreIn(*context_.uncollided, false, flights, count, path_of);
    if (context_.uncollided_by_reduced) ScoreIn(*context_.uncollided_by_reduced, true, flights, count, path_of);
  }

 private:
  template <class T>
  using Lanes = FlightLanes::Lanes<T>;
  /// Last collisions before the reduced coefficient, or all others.
  template <class PathOf>
  void ScoreIn(const UncollidedLight& light, bool is_last, const FlightLanes& flights, int count,
               const PathOf& path_of) {
    Locate(light, is_last, flights, count);
    int lit = 0;
    for (int i = 0; i < count; ++i)
      if (light.Open(part_[i], blocks_[lit])) lit_[lit++] = i;
    std::array<float, kMostChannels> weights;
    for (int k = 0; k < lit; ++k) {
      const int i = lit_[k];
      const Visit uncounted{.length_mm = flights.length_mm[i],
                            .collisions = static_cast<int>(flights.collisions[i]) + 1,
                            .phase_score = flights.phase_score[i]};
      CameraPath& path = path_of(i);
      const auto channels = static_cast<size_t>(media_.channels());
      if (is_simple_[i]) {
        for (size_t c = 0; c < channels; ++c) weights[c] = weight_[c][i];
      } else {
        const Spectrum weight = path.After(uncounted, [&] { return path.WeightOfCollision(); });
        for (size_t c = 0; c < channels; ++c) weights[c] = static_cast<float>(weight[static_cast<int>(c)]);
      }
      path.Collide(light, {blocks_[k], {at_x_[i], at_y_[i], at_z_[i]}}, {flights.dx[i], flights.dy[i], flights.dz[i]},
                   uncounted, weights);
    }
  }
  void Locate(const UncollidedLight& light, bool is_last, const FlightLanes& flights, int count);
  void Weigh(const FlightLanes& flights, int count);

  const PathContext& context_;
  const Media& media_;
  alignas(64) std::array<Lanes<float>, kMostChannels> begun_{};       ///< weights where the flights began
  alignas(64) std::array<Lanes<float>, kMostChannels> absorption_{};  ///< 1/mm
  alignas(64) std::array<Lanes<float>, kMostChannels> weight_{};
  alignas(64) Lanes<float> at_x_{}, at_y_{}, at_z_{};  ///< in cells
  alignas(64) Lanes<int> layer_{}, wanted_{}, part_{};
  Lanes<double> last_{};            ///< collision of the flights before the reduced coefficient; 0: none
  Lanes<bool> is_simple_{};         ///< absorption alone changes the weight
  Lanes<int> lit_{};                ///< lanes that collide where there is light ...
  Lanes<const int32_t*> blocks_{};  ///< ... and the light there, in the same order
};

}  // namespace crownfit
