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
  for (const Medium& m : media_)
    if (m.scattering != glm::dvec3(m.scattering.x)) heroes_ = 3;
}

glm::dvec3 Media::Left(const WalkState& state) const {
  glm::dvec3 absorbed(0.0);
  for (size_t i = 0; i < media_.size(); ++i) absorbed += Absorbed(i, state.visits[i]);
  return state.boost * glm::exp(-absorbed);
}

glm::dvec3 Media::Chance(const WalkState& state) const {
  if (heroes_ == 1) return glm::dvec3(1.0);
  glm::dvec3 log_chance(0.0);
  for (size_t i = 0; i < media_.size(); ++i) {
    const Visit& visit = state.visits[i];
    if (visit.length_mm == 0) continue;
    for (int c = 0; c < 3; ++c) {
      const double s = media_[i].scattering[c];
      log_chance[c] -= s * (visit.length_mm - (1.0 - media_[i].similarity()) * visit.reduced_mm);
      if (visit.collisions > 0) log_chance[c] += visit.collisions * std::log(s);  // -infinity where s = 0
    }
  }
  const double largest = std::max({log_chance.x, log_chance.y, log_chance.z});
  const glm::dvec3 chance = glm::exp(log_chance - largest);
  return chance * (3.0 / (chance.x + chance.y + chance.z));
}

double Media::LargestShare(const WalkState& state) const {
  const glm::dvec3 left = Left(state);
  return std::max({left.x, left.y, left.z});
}

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
