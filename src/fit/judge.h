#pragma once
// Judges a fit: what cannot be trusted, and whether the result is usable.

#include <vector>

#include "capture/capture.h"
#include "fit/fit_result.h"
#include "photo/photograph.h"

namespace crownfit {

/// Doubts about the photographs' files and their calibration.
std::vector<Finding> PhotographFindings(const Capture& capture, const std::vector<Photograph>& photographs);

/// Omissions of the model, and what the fit had to move.
std::vector<Finding> ModelFindings(const CrownFit& fit);

/// Fills `usable` and `reasons` from the rest (the contract's rules). `refusals`: reasons known beforehand.
void Judge(CrownFit& fit, std::vector<Finding> refusals = {});

/// "photographs", "measurements", or both: the data of this fit.
const char* SourceOf(const CrownFit& fit);

/// Names of the parameters with this status, with the channels where only some have it.
std::vector<std::string> NamesOfStatus(const CrownFit& fit, Status status);

}  // namespace crownfit
