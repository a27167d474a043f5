#pragma once
// The random walk inside the layers, for any geometry that can find the boundary a flight meets.
//
// Flights are sampled from one channel's scattering ("hero"). Absorption and the other channels' scattering enter as
// weights, computed from the walk's collisions and path length in each medium. Channels of equal scattering share every
// walk. Others are combined by the balance heuristic over heroes (Wilkie et al. 2014, hero wavelength spectral
// sampling).

#include <string>
#include <vector>

#include "path/medium.h"
#include "path/walk_scene.h"

namespace crownfit {

/// Collisions and path length of one walk in one medium: enough to change the coefficients afterwards.
struct Visit {
  double length_mm = 0;
  int collisions = 0;
  double phase_score = 0;      ///< sum of d ln(phase function) / d g, where derivatives are wanted
  double reduced_mm = 0;       ///< part of length_mm flown with the reduced coefficient
  int reduced_collisions = 0;  ///< part of `collisions` at the end of such flights
};

struct WalkCounters {
  uint64_t walks = 0, lost = 0, flights = 0, boundaries = 0;
  uint64_t searches = 0;  ///< flights whose end needed a search among facets
  double lost_share() const { return walks > 0 ? static_cast<double>(lost) / static_cast<double>(walks) : 0.0; }
  void Add(const WalkCounters& o) {
    walks += o.walks, lost += o.lost, flights += o.flights, boundaries += o.boundaries, searches += o.searches;
  }
};

/// A message with the share of lost walks; above 1e-5 with advice.
std::string LossesInWords(const WalkCounters& counters);

/// State of one walk.
struct WalkState {
  glm::dvec3 position{0.0}, direction{0.0};
  int medium = kOutside;
  double boost = 1.0;  ///< inverse survival probability of the roulette, times the reflectance of tiles in contact
  int boundaries = 0;  ///< number met from inside
  int collisions = 0;  ///< in all media
  std::vector<Visit> visits;          ///< per medium
  std::vector<Spectrum> textured_mm;  ///< per medium: length times its absorption texture; empty: none has one

  void Begin(size_t media, bool has_textures) {
    medium = kOutside;
    boost = 1.0;
    boundaries = collisions = 0;
    visits.assign(media, Visit());
    textured_mm.assign(has_textures ? media : 0, Spectrum());
  }
};

/// The media of a scene, and the weights that follow from them.
class Media {
 public:
  explicit Media(std::vector<Medium> media);
  const Medium& operator[](int i) const { return media_[i]; }
  size_t size() const { return media_.size(); }
  /// Number of heroes to average over: 1 when the channels scatter alike, else the number of channels.
  int heroes() const { return heroes_; }
  bool has_textures() const { return has_textures_; }
  int channels() const { return media_[0].scattering.size(); }
  /// Transmittance per channel, over the probability density of this path for a random hero.
  Spectrum Weight(const WalkState& state) const { return Left(state) * Chance(state); }
  /// Transmittance per channel, the roulette's boost included.
  Spectrum Left(const WalkState& state) const;
  /// Probability density of the path per channel, over that for a random hero; 1 when the channels scatter alike.
  Spectrum Chance(const WalkState& state) const;
  /// Optical depth of absorption.
  Spectrum Absorbed(size_t medium, const WalkState& state) const {
    return media_[medium].texture ? media_[medium].absorption * state.textured_mm[medium]
                                  : media_[medium].absorption * state.visits[medium].length_mm;
  }
  /// The largest transmittance of any channel, the roulette's boost included.
  double LargestShare(const WalkState& state) const;

 private:
  std::vector<Medium> media_;
  std::vector<Spectrum> log_scattering_;  ///< per medium
  int heroes_ = 1;
  bool has_textures_ = false;
};

/// With the reduced coefficient in place of the scattering coefficient.
Media Reduced(const Media& media);

inline constexpr int kRouletteEvery = 32;  // collisions of one walk: results depend on nothing else

/// Russian roulette for walks with little light left; false when the walk ends here.
bool SurvivesRoulette(const Media& media, WalkState& state, RandomStream& random);

/// Call at every boundary met from inside. Returns the factor on the walk's light, 0 when the walk ends here. Total
/// reflection traps light in clear layers with plane faces for ever. Beyond the number of boundaries that any other
/// walk meets, some few in a thousand walks end at each boundary, and the others represent them. `boundaries`: met so
/// far, this one included.
inline double BoostAtBoundary(int boundaries, RandomStream& random) {
  constexpr int kAllLive = 4096;
  constexpr double kSurvival = 0.998;
  if (boundaries <= kAllLive) return 1.0;
  return random.Next() < kSurvival ? 1.0 / kSurvival : 0.0;
}
bool SurvivesBoundary(WalkState& state, RandomStream& random);

/// Walks from inside a layer until the medium is the outside or satisfies `is_end`; false when absorbed or lost.
/// `cross(boundary)` decides what happens at a boundary: it sets the state's direction and medium.
template <class Scene, class Cross, class IsEnd>
bool Walk(const Scene& scene, const Media& media, int hero, WalkState& state, RandomStream& random,
          WalkCounters& counters, const Cross& cross, const IsEnd& is_end) {
  int until_roulette = kRouletteEvery;
  while (!is_end(state.medium)) {
    const Medium& medium = media[state.medium];
    Visit& visit = state.visits[state.medium];
    const double scattering = medium.scattering[hero];
    const auto travel = [&](double length_mm) {
      visit.length_mm += length_mm;
      if (medium.texture)
        state.textured_mm[state.medium] += medium.texture->Along(state.position, state.direction, length_mm);
    };
    for (;;) {
      const double flight = scattering > 0 ? -std::log(1.0 - random.Next()) / scattering : kFar;
      ++counters.flights;
      const auto boundary = scene.Next(state.position, state.direction, state.medium, flight);
      if (boundary) {
        travel(boundary->distance_mm);
        state.position = boundary->position;
        ++counters.boundaries;
        if (!SurvivesBoundary(state, random)) return false;
        cross(*boundary);
        break;
      }
      if (std::isinf(flight)) {  // clear medium without an end: rounding let the walk pass between two facets
        ++counters.lost;
        return false;
      }
      travel(flight);
      ++visit.collisions;
      state.position += flight * state.direction;
      state.direction = SamplePhaseFunction(medium, state.direction, random);
      if (--until_roulette == 0) {
        until_roulette = kRouletteEvery;
        if (!scene.Holds(state.position)) {
          ++counters.lost;
          return false;
        }
        if (!SurvivesRoulette(media, state, random)) return false;
      }
    }
  }
  return true;
}

}  // namespace crownfit
