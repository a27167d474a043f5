#pragma once
// Colour transform from the patches of a chart, with its residual error in CIEDE2000.

#include <optional>
#include <string>
#include <vector>

#include "calibration/colour_chart.h"
#include "photo/colour.h"

namespace crownfit {

struct ColourEstimate {
  ColourTransform transform;
  glm::dvec3 white{
      0.0};  ///< what the transform maps to (1, 1, 1): a perfect white under the chart's light; no patch is one
  std::vector<double> de00;  ///< of every patch, used or not
  std::vector<size_t> used;
  double mean = 0, worst = 0;       ///< over the used patches
  double leave_one_out = 0;         ///< mean over used patches, each predicted by a transform fitted to the others
  double leave_one_out_matrix = 0;  ///< the same with a 3 x 3 matrix
  double tone_slope = 1;            ///< of log value against log reflectance over the grey patches; 1: linear
  double fall_off = 0, fall_off_stddev = 0;  ///< relative change of light across the chart, from its patches
};

/// Fits a 3 x 3 matrix to the undamaged readings, or a root polynomial of the second degree where that lowers the
/// leave-one-out error by a tenth. Patches that no transform fits (dE00 over 8 and four times the median) are left out,
/// at most four, and named in their `damage`. Absent with fewer than 12 patches.
std::optional<ColourEstimate> EstimateColour(const Chart& chart, std::vector<PatchReading>& readings);

/// Readings in the chart's order, rotated by 180 degrees where that fits. Empty when they fit better mirrored, or in no
/// order.
std::vector<PatchReading> InOrder(const Chart& chart, const std::vector<PatchReading>& readings, std::string& fault);

/// Correlation of the readings' luminances with the chart's, in the best of its orders; up to 1.
double AgreementOf(const Chart& chart, const std::vector<PatchReading>& readings);

}  // namespace crownfit
