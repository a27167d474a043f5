#pragma once
// Lines and marks on pictures.

#include <glm/glm.hpp>

#include "photo/image_io.h"

namespace crownfit {

void DrawLine(Image& image, glm::dvec2 from, glm::dvec2 to, const glm::dvec3& colour);
void DrawDot(Image& image, glm::dvec2 centre, double radius, const glm::dvec3& colour);
void DrawRectangle(Image& image, glm::dvec2 low, glm::dvec2 high, const glm::dvec3& colour);
void FillRectangle(Image& image, glm::dvec2 low, glm::dvec2 high, const glm::dvec3& colour);

/// A displayable copy of a linear picture, `zoom` times as large: its 99th percentile is white, encoded as sRGB.
Image DisplayCopy(const Image& linear, double zoom);

/// Appends a picture below another.
void AppendBelow(Image& all, const Image& next);

/// Colours that are easy to distinguish on white; they repeat.
glm::dvec3 DistinctColour(size_t index);

}  // namespace crownfit
