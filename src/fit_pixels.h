#pragma once
// Which pixels a fit uses, and what each of them is a sum of.

#include <span>
#include <string>
#include <vector>

#include "base/progress.h"
#include "calibration/calibration_error.h"
#include "fit/nuisances.h"
#include "fit_steps.h"

namespace crownfit {

/// Inside the mask and not saturated.
bool IsUsable(const Photograph& photo, const PixelCast& pixel);

/// Of a photograph's pixel, with what the unknown beyond an open scan's neck adds.
glm::dvec3 VarianceAt(const Photograph& photo, const PixelCast& pixel);

/// Photographs that share one fitted exposure have the same.
std::string ExposureGroup(const PhotographSpec& spec);

/// Indices into the cast's pixels: usable ones whose square lies on the object, beyond the reach of its rim's blur.
std::vector<int> ComparablePixels(const PhotographSpec& spec, const PhotographCast& cast, const Photograph& photo,
                                  int threads);

/// Pixels for the fit: comparable ones, of every n-th row and column when there are more than `max_pixels`. Holdouts
/// are left out. Throws InputError when a photograph offers none.
std::vector<FitPixels> ChoosePixels(const CrownInput& input, const CastState& state, size_t max_pixels);

/// The same photograph with these of its pixels (indices into FitPixels::pixels) alone.
FitPixels Subset(const FitPixels& pixels, std::span<const int> which);

inline constexpr int kStrataOfMoved = 4;  ///< of a lamp, and of the half-space: SlopesOf's two sides share directions

/// What moving the calibration by its stated errors changes, by casting again half a standard deviation to either side
/// of `amounts`. Pixels that some of these put off the object are taken out of `pixels`. `stated`: the capture as it
/// came; `state`: cast with its calibration moved by `amounts`.
std::vector<CalibrationSlopes> SlopesOf(const CrownInput& input, const Capture& stated,
                                        const std::vector<CalibrationError>& errors, const std::vector<double>& amounts,
                                        const CastState& state, const Material& material,
                                        const std::vector<double>& light_scale, CastOptions options,
                                        std::vector<FitPixels>& pixels, Progress& progress);

/// Moves the calibration by what the fit found; true when that is so far that photographs should be cast again, or when
/// the fit had no slopes yet.
bool MoveCalibration(const LinearScales& scales, CalibrationState& calibration);

/// Per thing that may be wrong: how far the fit moved it.
std::vector<MovedCalibration> HowFarMoved(const std::vector<CalibrationError>& errors,
                                          const std::vector<double>& amounts);
/// The same of exposures and intensities that are known within an error.
std::vector<MovedCalibration> HowFarScaled(const Capture& capture, const std::vector<FitPixels>& pixels,
                                           const LinearScales& scales);

}  // namespace crownfit
