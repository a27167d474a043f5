#pragma once
// Several captures of one material: discs of several thicknesses, several crowns from one blank.

#include "fit_crown.h"

namespace crownfit {

/// Fits captures that share the scattering, absorption, index and phase function of layers with the same name. Every
/// capture keeps its own thicknesses, surface, exposures and lamps. First every capture is fitted alone. Then each is
/// fitted again with the information of the others' photographs, as a Gaussian over the shared entries around their
/// optimum. This repeats until none moves by more than a third of its standard deviation (expectation propagation with
/// Gaussian sites, Minka 2001; exact where models are linear over the intervals). Results are in the captures' order
/// and agree in all that is shared. The information of each capture alone is compared with that of the others:
/// contradictions are caveats. A single capture is fitted as it is. Throws InputError when captures do not state the
/// same material.
std::vector<CrownFit> FitTogether(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress);

/// One result for all: shared values, the first capture's values for what is not shared, and every photograph.
CrownFit Joined(const std::vector<CrownFit>& fits);

}  // namespace crownfit
