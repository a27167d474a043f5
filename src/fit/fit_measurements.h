#pragma once
// Fits by what instruments have read of flat samples.

#include "base/progress.h"
#include "capture/capture.h"
#include "fit/fit_options.h"
#include "fit/fit_result.h"

namespace crownfit {

/// The fit of a capture without photographs, by model `layered`. Throws InputError.
CrownFit FitMeasurements(const Capture& capture, const FitOptions& options, Progress& progress,
                         const KnownBeside& beside = {});

/// What such a fit would know of each free entry at the capture's start values: its covariance.
DataEstimate ForeseeMeasurements(const Capture& capture, const FreeParameters& free, int threads);

/// Every reading of the capture beside what the material would give, held-out ones included.
std::vector<ReadingResult> CompareMeasurements(const Capture& capture, const Material& material);

}  // namespace crownfit
