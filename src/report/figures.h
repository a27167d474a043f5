#pragma once
// Pictures for people.

#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "report/colour_difference.h"

namespace crownfit {

/// Photograph, prediction and CIEDE2000 map side by side, at one brightness scale, cropped to the mask, with a legend
/// in steps of 0.8 (perceptible) and 1.8 (acceptable). Linear input, sRGB output in [0, 1].
Image TriptychFigure(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                     const ColourDifference& difference, const glm::dmat3& rgb_from_sensor, const std::string& title);

/// CIEDE2000 map alone, with its legend.
Image DifferenceFigure(const ColourDifference& difference);

/// A linear picture as sRGB, scaled by `scale`.
Image DisplayPicture(const Image& linear, double scale, const glm::dmat3& rgb_from_sensor = glm::dmat3(1.0));

}  // namespace crownfit
