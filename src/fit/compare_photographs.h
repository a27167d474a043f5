#pragma once
// Predicted photographs beside the measured ones, for a result.

#include <functional>
#include <vector>

#include "fit/fit_result.h"
#include "fit/image_residuals.h"
#include "scene/cast_samples.h"
#include "scene/crown_input.h"

namespace crownfit {

/// A photograph's pixels at exposure 1, in the order of its cast.
struct PredictedPixels {
  std::vector<Spectrum> values;
  std::vector<Spectrum> variances = {};  ///< of the model's random walks; empty: it uses none
};
using Predictor = std::function<PredictedPixels(size_t photograph)>;
/// All arguments must outlive the predictor.
Predictor PredictorByShader(const CrownInput& input, const CastState& state, const Material& material,
                            const LinearScales& scales, int threads);

/// Predicts every photograph, held-out ones included, and compares. `stddev`: of `scales`; empty: not known.
std::vector<PhotographResult> ComparePhotographs(const CrownInput& input, const CastState& state,
                                                 const Predictor& predict, const LinearScales& scales,
                                                 const std::vector<FitPixels>& fitted, int threads,
                                                 const LinearScales& stddev = {});

}  // namespace crownfit
