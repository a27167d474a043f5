#pragma once
// Derivatives of the photographs by errors of the stated calibration, and how far a fit has moved it.

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
    4;  ///< per lamp, and over the half-space: both sides of CalibrationDerivativesOf use the same directions

/// Derivatives of pixels by stated errors: casts again half a standard deviation to either side of `amounts`. Pixels
/// that leave the object in one of these casts are removed from `pixels`. `stated`: the capture as given; `state`: cast
/// with its calibration moved by `amounts`.
std::vector<CalibrationDerivatives> CalibrationDerivativesOf(
    const CrownInput& input, const Capture& stated, const std::vector<CalibrationError>& errors,
    const std::vector<double>& amounts, const CastState& state, const Material& material,
    const std::vector<double>& light_scale, CastOptions options, std::vector<FitPixels>& pixels, Progress& progress);

/// Moves the calibration by the fit's result. True when photographs should be cast again: it moved far, or the fit had
/// no derivatives yet.
bool MoveCalibration(const LinearScales& scales, CalibrationState& calibration);

/// How far the fit moved each pose and lamp with a stated error.
std::vector<MovedCalibration> HowFarMoved(const std::vector<CalibrationError>& errors,
                                          const std::vector<double>& amounts);
/// The same for exposures and intensities with a stated error.
std::vector<MovedCalibration> HowFarScaled(const Capture& capture, const std::vector<FitPixels>& pixels,
                                           const LinearScales& scales);

}  // namespace crownfit
