#pragma once
// The stages of a fit by walks.

#include <cstddef>
#include <cstdint>

#include "fit_path/walked_step.h"

namespace crownfit {

inline constexpr uint64_t kFitStream = 0x6669747365656bull;  ///< no photograph's synthesis is keyed by it

/// What a stage walks at every place, and how far it goes from there.
struct Stage {
  const char* name;         ///< in run.json
  size_t pixels;            ///< of a photograph, at most
  double values;            ///< paths of a photograph at a place, for values
  double slopes;            ///< paths of a photograph for derivatives, those from near by included
  double longest;           ///< trust region: the longest step, in a value's logarithm (more absorption: twice that)
  double reach;             ///< standard deviation of the prior that keeps steps short, in logarithms
  WalkedStep::Noise noise;  ///< of derivatives: left in, steps fall short, the safer the noisier derivatives are
  int most;                 ///< places
};

/// Until steps are short or gain no more than noise: about as many paths as cost what is fixed (cells, fields).
inline constexpr Stage kSearch{"search", 2500, 100e3, 100e3, 0.7, 0.4, WalkedStep::Noise::kLeft, 12};
/// Steps from one place to the next, whose mean is the result: the first with so many paths, later ones with as many as
/// are lacking, --walks in all.
inline constexpr Stage kRun{"run", 12000, 250e3, 150e3, 0.5, 1.0, WalkedStep::Noise::kTakenOff, 8};

}  // namespace crownfit
