#pragma once
// What a photograph says itself of moving the camera: its own gradient, along the way its points go.

#include "crown_input.h"
#include "fit_state.h"

namespace crownfit {

/// Where errors of pose move the picture, the photograph's own gradient takes the place of the shader picture's (Lucas
/// and Kanade 1981): at each pixel the slope of a plane through its neighbours, whose noise is not the pixel's own, by
/// the share in which it is more than noise. What shader's slopes (at.calibration.slopes, of SlopesOf) have beside
/// stays: gloss that stands still, lamps that move with the camera. Where the picture is steep shader may not be: the
/// rims of clear enamel glow, and move it three times as much. `input`: its capture as at.cast was cast.
void TakePhotographsOwnGradients(const FitProblem& problem, const CrownInput& input, FitState& at);

}  // namespace crownfit
