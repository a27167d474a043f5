#pragma once
// Derivatives of a path's value by the parameters of its media, computed from that path alone.
//
// The probability density of a walk and its transmittance are known functions of the coefficients. In a layer with n
// collisions and path length L, d ln / d ln scattering = n - scattering L (the score, or likelihood ratio; Rubinstein
// 1989), and d ln / d ln absorption = -absorption L. The derivative by scattering is by its reduced value at constant
// g. The derivative by g holds the reduced scattering constant.
//
// Scores are noisy, but their mean is zero. A control variate is their sum along the path, each step weighted with the
// transmittance at its start. Its mean is zero too, and it is correlated with the derivative. So subtracting a multiple
// of it removes only noise.

#include <optional>
#include <vector>

#include "path/random_walk.h"

namespace crownfit {

/// d ln(reflectance of the neck's cut), by the innermost layer's parameters.
struct CutDerivatives {
  Spectrum scattering, absorption;
};

/// Derivatives per layer and channel: by ln reduced scattering, by ln absorption, by g.
struct LayerDerivatives {
  Spectrum scattering, absorption, asymmetry;
};
/// Zero-mean control variates of two of them.
struct LayerControls {
  Spectrum scattering, asymmetry;
};

/// Derivatives of one path for all the photographs that it serves.
class PathDerivatives {
 public:
  PathDerivatives(const Media& media, const CutDerivatives& cut, size_t photographs)
      : media_(media),
        cut_(cut),
        layers_(media.size() - 1),
        derivatives_(photographs * layers_),
        controls_(photographs * layers_),
        from_(media.size()) {}

  void Begin() {
    derivatives_.assign(derivatives_.size(), {});
    controls_.assign(controls_.size(), {});
    from_.assign(from_.size(), Visit());
  }
  /// Adds light that the current path found for a photograph. `cut_returns`: number of reflections at the neck's cut.
  void Add(size_t photograph, const WalkState& state, int cut_returns, const Spectrum& value) {
    LayerDerivatives* derivatives = &derivatives_[photograph * layers_];
    for (size_t l = 0; l < layers_; ++l) {
      const Score score = ScoreOf(l + 1, state.visits[l + 1]);
      derivatives[l].scattering += value * score.scattering;
      derivatives[l].asymmetry += value * score.asymmetry;
      derivatives[l].absorption -= value * media_.Absorbed(l + 1, state);
    }
    derivatives[layers_ - 1].scattering += value * static_cast<double>(cut_returns) * cut_.scattering;
    derivatives[layers_ - 1].absorption += value * static_cast<double>(cut_returns) * cut_.absorption;
  }

  /// Adds derivatives of the light that a walk found, weighted.
  void AddOfLight(size_t photograph, size_t layer, const LayerDerivatives& by) {
    LayerDerivatives& derivatives = derivatives_[photograph * layers_ + layer];
    derivatives.scattering += by.scattering;
    derivatives.absorption += by.absorption;
    derivatives.asymmetry += by.asymmetry;
  }

  /// Begins a segment of flights through one medium, with this share of the light left. CloseStretch ends it.
  void OpenStretch(const WalkState& state, const Spectrum& left) {
    from_[state.medium] = state.visits[state.medium];
    left_ = left;
  }
  std::optional<LayerControls> CloseStretch(const WalkState& state) {
    const size_t medium = state.medium;
    if (medium == kOutside) return std::nullopt;
    const Visit &from = from_[medium], &to = state.visits[medium];
    const Score score = ScoreOf(medium, {.length_mm = to.length_mm - from.length_mm,
                                         .collisions = to.collisions - from.collisions,
                                         .phase_score = to.phase_score - from.phase_score,
                                         .reduced_mm = to.reduced_mm - from.reduced_mm,
                                         .reduced_collisions = to.reduced_collisions - from.reduced_collisions});
    const Spectrum weight = left_ * media_.Chance(state);
    from_[medium] = to;
    return LayerControls{weight * score.scattering, weight * score.asymmetry};
  }
  void AddControls(size_t photograph, int medium, const LayerControls& c) {
    LayerControls& sum = controls_[photograph * layers_ + medium - 1];
    sum.scattering += c.scattering;
    sum.asymmetry += c.asymmetry;
  }

  /// Photograph by photograph, layer by layer.
  const std::vector<LayerDerivatives>& derivatives() const { return derivatives_; }
  const std::vector<LayerControls>& controls() const { return controls_; }

 private:
  struct Score {
    Spectrum scattering, asymmetry;
  };
  Score ScoreOf(size_t medium, const Visit& visit) const {
    const Medium& m = media_[static_cast<int>(medium)];
    const Spectrum reduced =
        static_cast<double>(visit.reduced_collisions) - m.similarity() * m.scattering * visit.reduced_mm;
    const Spectrum scattering = static_cast<double>(visit.collisions - visit.reduced_collisions) -
                                m.scattering * (visit.length_mm - visit.reduced_mm);
    return {scattering + reduced, visit.phase_score + scattering * m.ScatteringByAsymmetry()};
  }
  const Media& media_;
  CutDerivatives cut_;
  size_t layers_;
  std::vector<LayerDerivatives> derivatives_;
  std::vector<LayerControls> controls_;
  std::vector<Visit> from_;
  Spectrum left_ = Spectrum(1.0);
};

}  // namespace crownfit
