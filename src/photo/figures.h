#pragma once
// Figures of photographs, predictions and their differences.

#include <array>
#include <cmath>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "photo/colour_difference.h"

namespace crownfit {

/// A colour of difference maps.
struct DifferenceStep {
  double below;
  glm::vec3 colour;
  const char* label;
};

/// Sequential in lightness, so that it reads in grey too. Borders: perceptible, acceptable, and multiples of the
/// latter.
inline const std::array<DifferenceStep, 5> kDifferenceSteps{
    {{kPerceptible, {0.13f, 0.40f, 0.67f}, "below 0.8: not seen"},
     {kAcceptable, {0.57f, 0.77f, 0.87f}, "0.8 to 1.8: acceptable"},
     {2 * kAcceptable, {0.99f, 0.86f, 0.62f}, "1.8 to 3.6"},
     {4 * kAcceptable, {0.94f, 0.54f, 0.38f}, "3.6 to 7.2"},
     {HUGE_VAL, {0.70f, 0.09f, 0.17f}, "above 7.2"}}};

/// Columns x0 to x1 - 1 and rows y0 to y1 - 1.
struct PixelBox {
  int x0, y0, x1, y1;
};

/// Bounds of the compared pixels, with a margin; the whole picture when nothing was compared.
PixelBox BoxAround(const Image& difference_map);

/// A CIEDE2000 map in the colours of its legend; `elsewhere` where nothing was compared.
Image DifferenceColours(const ColourDifference& difference, const glm::vec3& elsewhere);

/// Photograph, prediction and CIEDE2000 map side by side, at one brightness scale, cropped to the mask, with a legend
/// in steps of 0.8 (perceptible) and 1.8 (acceptable). Linear input, sRGB output in [0, 1].
Image TriptychFigure(const Image& photograph, const Image& prediction, const std::vector<uint8_t>& mask,
                     const ColourDifference& difference, const ColourTransform& rgb_from_sensor,
                     const std::string& title);

/// CIEDE2000 map alone, with its legend.
Image DifferenceFigure(const ColourDifference& difference);

/// A linear picture as sRGB, scaled by `scale`.
Image DisplayPicture(const Image& linear, double scale, const ColourTransform& rgb_from_sensor = {});

}  // namespace crownfit
