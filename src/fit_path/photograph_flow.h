#pragma once
// What a picture says itself of moving the camera: its own gradient, along the way its points go.

#include "fit/fit_state.h"
#include "path/path_photograph.h"
#include "scene/crown_input.h"

namespace crownfit {

/// A photograph's pixels as something else knows them, by FitPixels::pixels and as the photograph was exposed.
struct KnownPicture {
  std::vector<Spectrum> values, variances;  ///< empty: it is not known
};

/// By walks, by rank; so many paths a pixel.
struct WalkedPicture {
  const std::vector<PixelEstimate>* pixels;
  double paths;
};
/// Their mean as the lens spreads it, by FitPixels::pixels; `ranks`: of FitPixels::sources.
KnownPicture MeanPicture(const FitPixels& p, double exposure, const std::vector<size_t>& ranks,
                         const std::vector<WalkedPicture>& walked);

/// Where errors of pose move the picture of at.pixels[number], its own gradient takes the place of the shader picture's
/// (Lucas and Kanade 1981): at each pixel the slope of a parabola through its neighbours, whose noise is not the
/// pixel's own, by the share in which it is more than noise. It is the photograph's, and that of `walked`, each by how
/// well it is known: noise alone looks like a picture that tells the pose, and of a pose that is told by noise too half
/// an error stays at every step. What shader's derivatives (at.calibration.derivatives, of CalibrationDerivativesOf)
/// have beside stays: gloss that stands still, lamps that move with the camera. Where the picture is steep shader may
/// not be: the rims of clear enamel glow, and move it three times as much. `input`: its capture about where at.cast was
/// cast.
void TakeOwnGradients(const FitProblem& problem, const CrownInput& input, size_t number, const KnownPicture& walked,
                      FitState& at);

}  // namespace crownfit
