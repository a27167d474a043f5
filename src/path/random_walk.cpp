#include "path/random_walk.h"

#include "base/text.h"

namespace crownfit {

std::string LossesInWords(const WalkCounters& counters) {
  constexpr double kAcceptable = 1e-5;
  return Printed(
      "%llu random walks, %llu lost between triangles (%.1f in a million)%s",
      static_cast<unsigned long long>(counters.walks), static_cast<unsigned long long>(counters.lost),
      1e6 * counters.lost_share(),
      counters.lost_share() > kAcceptable
          ? ". The limit is 10: the picture is too dark by about this share. Check for surfaces that touch or cross."
          : "");
}

Media::Media(std::vector<Medium> media) : media_(std::move(media)) {
  for (const Medium& m : media_) {
    if (!m.scattering.IsGrey()) heroes_ = m.scattering.size();
    has_textures_ |= m.texture != nullptr;
    log_scattering_.push_back(Log(m.scattering));
  }
}

Media Reduced(const Media& media) {
  std::vector<Medium> reduced;
  for (int i = 0; i < static_cast<int>(media.size()); ++i) {
    reduced.push_back(media[i]);
    reduced.back().scattering *= media[i].similarity();
  }
  return Media(std::move(reduced));
}

Spectrum Media::Left(const WalkState& state) const {
  Spectrum absorbed(channels(), 0.0);
  for (size_t i = 0; i < media_.size(); ++i)
    if (state.visits[i].length_mm > 0) absorbed += Absorbed(i, state);
  return Spectrum::Of(channels(), [&](int c) { return state.boost * std::exp(-std::as_const(absorbed)[c]); });
}

Spectrum Media::Chance(const WalkState& state) const {
  if (heroes_ == 1) return Spectrum(1.0);
  Spectrum log_chance(channels(), 0.0);
  for (size_t i = 0; i < media_.size(); ++i) {
    const Visit& visit = state.visits[i];
    if (visit.length_mm == 0) continue;
    log_chance -= media_[i].scattering * (visit.length_mm - (1.0 - media_[i].similarity()) * visit.reduced_mm);
    // -infinity where a channel does not scatter
    if (visit.collisions > 0) log_chance += static_cast<double>(visit.collisions) * log_scattering_[i];
  }
  const Spectrum chance = Exp(log_chance - log_chance.Largest());
  return chance * (static_cast<double>(heroes_) / chance.Sum());
}

double Media::LargestShare(const WalkState& state) const { return Left(state).Largest(); }

bool SurvivesBoundary(WalkState& state, RandomStream& random) {
  const double boost = BoostAtBoundary(++state.boundaries, random);
  state.boost *= boost;
  return boost > 0;
}

bool SurvivesRoulette(const Media& media, WalkState& state, RandomStream& random) {
  constexpr double kBelow = 0.03, kSurvival = 0.25;
  if (media.LargestShare(state) >= kBelow) return true;
  if (random.Next() >= kSurvival) return false;
  state.boost /= kSurvival;
  return true;
}

}  // namespace crownfit
