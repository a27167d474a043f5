#pragma once
// colour.json from a chart, or from a grey card alone.

#include <array>

#include "calibration/estimate_colour.h"
#include "calibration/product.h"

namespace crownfit {

struct ColourSource {
  const Image* picture = nullptr;  ///< to draw on; may be null
  bool is_encoded = false, is_jpeg = false;
};

/// colour.json with its figures, gates and picture.
Product ColourProduct(const Chart& chart, const std::vector<PatchReading>& readings, const ColourSource& source);

/// colour.json from a grey or white card, read in a rectangle (x, y, width, height in pixels). White balance only, a
/// diagonal matrix; colours stay the camera's own.
Product GreyCardProduct(const Image& linear, const std::array<double, 4>& rectangle, double reflectance,
                        const glm::dvec3& saturation, const ColourSource& source);

}  // namespace crownfit
