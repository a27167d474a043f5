#pragma once
// From patches of a chart to a colour transform, with what it leaves in CIEDE2000.

#include <optional>
#include <string>
#include <vector>

#include "calibration/colour_chart.h"
#include "photo/colour.h"

namespace crownfit {

struct ColourEstimate {
  ColourTransform transform;
  glm::dvec3 white{
      0.0};  ///< what the transform makes (1, 1, 1) of: a perfect white under the chart's light; no patch is one
  std::vector<double> de00;  ///< of every patch, used or not
  std::vector<size_t> used;
  double mean = 0, worst = 0;       ///< over the used patches
  double leave_one_out = 0;         ///< mean over used patches, each predicted by a transform that the others make
  double leave_one_out_matrix = 0;  ///< the same with a 3 x 3 matrix
  double tone_slope = 1;            ///< of log value against log reflectance over the grey patches; 1: linear
  double fall_off = 0, fall_off_stddev = 0;  ///< relative change of light across the chart that the patches show
};

/// Fits a 3 x 3 matrix to the readings that are not damaged, and a root polynomial of the second degree in its place
/// where leaving patches out prefers that by a tenth. Patches that no transform fits (dE00 over 8 and four times the
/// median) are left out, at most four, and named in their `damage`. Nothing with fewer than 12 patches.
std::optional<ColourEstimate> EstimateColour(const Chart& chart, std::vector<PatchReading>& readings);

/// Readings in the chart's order: turned by 180 degrees when that is what they show. Empty when they fit better
/// mirrored, or in no order.
std::vector<PatchReading> InOrder(const Chart& chart, const std::vector<PatchReading>& readings, std::string& fault);

/// How well the readings' luminances follow the chart's, in the best of its orders: a correlation, up to 1.
double AgreementOf(const Chart& chart, const std::vector<PatchReading>& readings);

}  // namespace crownfit
