#pragma once
// Several captures of one material: discs of several thicknesses, several crowns from one blank.

#include "fit_crown.h"

namespace crownfit {

/// Fits captures that share the scattering, absorption, index and phase function of layers with the same name; every
/// capture keeps its own thicknesses, surface, exposures and lamps. First every capture alone; then each again with
/// what the photographs of the others say, as a Gaussian over the shared entries around where they stand, until none
/// moves by more than a third of its standard deviation (expectation propagation with Gaussian sites, Minka 2001; exact
/// where models are linear over the intervals). Results
/// are in the captures' order and agree in all that is shared. What each capture says alone is held against what the
/// others say: contradictions are caveats. One capture is fitted as it is. Throws InputError when captures do not state
/// the same material.
std::vector<CrownFit> FitTogether(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress);

/// One result for all: values of what they share, of the first for what they don't, and every photograph.
CrownFit Joined(const std::vector<CrownFit>& fits);

}  // namespace crownfit
