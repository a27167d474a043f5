#pragma once
// What to make of a fit: what can not be trusted, and whether it may be used.

#include <vector>

#include "capture/capture.h"
#include "fit/fit_result.h"
#include "photo/photograph.h"

namespace crownfit {

/// What the photographs' files and their calibration make doubtful.
std::vector<Finding> PhotographFindings(const Capture& capture, const std::vector<Photograph>& photographs);

/// What the model leaves out, and what the fit had to move.
std::vector<Finding> ModelFindings(const CrownFit& fit);

/// Fills `usable` and `reasons` from the rest (the contract's rules). `refusals`: such as are known beforehand.
void Judge(CrownFit& fit, std::vector<Finding> refusals = {});

/// "photographs", "measurements", or both: what speaks in this fit.
const char* SourceOf(const CrownFit& fit);

/// Names of the parameters of a status, with the channels where not all of them are of it.
std::vector<std::string> NamesOfStatus(const CrownFit& fit, Status status);

}  // namespace crownfit
