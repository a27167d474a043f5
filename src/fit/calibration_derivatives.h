#pragma once
// What errors of the stated calibration change in the photographs, and how far a fit has moved it.

#include <vector>

#include "base/progress.h"
#include "capture/calibration_error.h"
#include "fit/fit_result.h"
#include "fit/nuisances.h"
#include "optics/material.h"
#include "scene/cast_samples.h"
#include "scene/crown_input.h"

namespace crownfit {

inline constexpr int kStrataOfMoved =
    4;  ///< of a lamp, and of the half-space: CalibrationDerivativesOf's two sides share directions

/// What moving the calibration by its stated errors changes, by casting again half a standard deviation to either side
/// of `amounts`. Pixels that some of these put off the object are taken out of `pixels`. `stated`: the capture as it
/// came; `state`: cast with its calibration moved by `amounts`.
std::vector<CalibrationDerivatives> CalibrationDerivativesOf(
    const CrownInput& input, const Capture& stated, const std::vector<CalibrationError>& errors,
    const std::vector<double>& amounts, const CastState& state, const Material& material,
    const std::vector<double>& light_scale, CastOptions options, std::vector<FitPixels>& pixels, Progress& progress);

/// Moves the calibration by what the fit found; true when that is so far that photographs should be cast again, or when
/// the fit had no derivatives yet.
bool MoveCalibration(const LinearScales& scales, CalibrationState& calibration);

/// Per thing that may be wrong: how far the fit moved it.
std::vector<MovedCalibration> HowFarMoved(const std::vector<CalibrationError>& errors,
                                          const std::vector<double>& amounts);
/// The same of exposures and intensities that are known within an error.
std::vector<MovedCalibration> HowFarScaled(const Capture& capture, const std::vector<FitPixels>& pixels,
                                           const LinearScales& scales);

}  // namespace crownfit
