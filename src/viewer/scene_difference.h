#pragma once
// Compares a photograph with the viewer's picture from its camera, as a fit's figures do.

#include "photo/colour_difference.h"
#include "scene/crown.h"
#include "scene/crown_input.h"

namespace crownfit {

struct SceneDifference {
  ColourDifference colours;
  Image map;  ///< in the legend's colours
  double exposure = 1;
  int number = 0;  ///< running number of the comparison
};

/// The pixels that a fit's figures compare: whole on the object, inside the photograph's mask, not saturated.
std::vector<uint8_t> PixelsToCompare(const CrownInput& input, const Capture& capture, const Crown& crown,
                                     const Photograph& photo, size_t photograph, int threads);

/// Pixels that are not black.
std::vector<uint8_t> LitPixels(const Image& picture);

/// `prediction`: at exposure 1. An exposure that neither capture nor fit states is fitted to the photograph.
SceneDifference Compare(const PhotographSpec& spec, const Photograph& photo, Image prediction,
                        const std::vector<uint8_t>& mask);

}  // namespace crownfit
