#pragma once
// Fits to instrument readings of flat samples.

#include "base/progress.h"
#include "capture/capture.h"
#include "fit/fit_options.h"
#include "fit/fit_result.h"

namespace crownfit {

/// The fit of a capture without photographs, by model `layered`. Throws InputError.
CrownFit FitMeasurements(const Capture& capture, const FitOptions& options, Progress& progress,
                         const KnownBeside& beside = {});

/// Expected information of such a fit on the free entries, at the capture's start values: their covariance.
DataEstimate ForeseeMeasurements(const Capture& capture, const FreeParameters& free, int threads);

/// Every reading of the capture with the material's prediction of it, held-out ones included.
std::vector<ReadingResult> CompareMeasurements(const Capture& capture, const Material& material);

}  // namespace crownfit
