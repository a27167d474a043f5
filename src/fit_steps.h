#pragma once
// The named steps of FitCrown that join modules.

#include <functional>
#include <optional>

#include "base/progress.h"
#include "crown_input.h"
#include "geometry/cast_samples.h"
#include "report/crown_fit.h"

namespace crownfit {

/// Casts every photograph (or only number `only`) on the crown built with these thicknesses.
CastState CastAll(const CrownInput& input, const std::vector<double>& thickness_mm, const CastOptions& options,
                  Progress& progress, std::optional<size_t> only = {});

/// Thickness per layer, as BuildCrown wants it.
std::vector<double> ThicknessesOf(const Capture& capture, const Material& material);

/// What lengths of a crown built with these thicknesses were cast at: a free thickness of the last layer scales what
/// its mesh has.
std::vector<double> CastThicknesses(const Capture& capture, const Crown& crown, std::vector<double> built_mm);

/// To be said where a fixed thickness of the last layer is not its mesh's depth; else empty.
std::string DepthNote(const Capture& capture, const Crown& crown);

/// True when a fitted thickness is so far from the cast one that lengths should be cast again: by more than 0.1 % and
/// more than a tenth of its standard deviation.
bool GeometryIsStale(const FreeParameters& free, const Eigen::VectorXd& cast_at, const Eigen::VectorXd& x,
                     const DataKnowledge& knowledge);

/// x with the thicknesses half way between cast and fitted: lengths that scale on one cast overshoot about as much as
/// they correct, and full steps go back and forth (seen: 0.6013, 0.5989, 0.6013, ... around 0.6000).
Eigen::VectorXd HalfWay(const FreeParameters& free, const Eigen::VectorXd& cast_at, Eigen::VectorXd x);

/// Whether a photograph states its blur.
bool AnyBlurred(const Capture& capture);

/// A photograph's pixels at exposure 1, in the order of its cast.
struct PredictedPixels {
  std::vector<glm::dvec3> values;
  std::vector<glm::dvec3> variances = {};  ///< by the model's own random walks; empty: it has none
};
using Predictor = std::function<PredictedPixels(size_t photograph)>;
/// All must outlive it.
Predictor PredictorByShader(const CrownInput& input, const CastState& state, const Material& material,
                            const LinearScales& scales, int threads);

/// Predicts every photograph, held-out ones included, and compares. `stddev`: of `scales`; empty: not known.
std::vector<PhotographResult> ComparePhotographs(const CrownInput& input, const CastState& state,
                                                 const Predictor& predict, const LinearScales& scales,
                                                 const std::vector<FitPixels>& fitted, int threads,
                                                 const LinearScales& stddev = {});

}  // namespace crownfit
