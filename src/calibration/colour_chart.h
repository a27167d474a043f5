#pragma once
// Colour charts: reference values of their patches, and readings of them in photographs.

#include <array>
#include <filesystem>
#include <glm/glm.hpp>
#include <map>
#include <string>
#include <vector>

#include "photo/image.h"

namespace crownfit {

struct ChartPatch {
  std::string name;
  glm::dvec3 linear_rgb;  ///< linear sRGB under D65, white 1
};

struct Chart {
  std::string name;
  int columns = 6;
  std::vector<ChartPatch> patches;  ///< row by row from the top left
  int rows() const { return static_cast<int>(patches.size()) / columns; }
};

/// Charts that come with the program: the text of files in calib/, by file name.
const std::map<std::string, std::string>& ChartTexts();

/// A built-in chart, or a file ("crownfit-chart/1").
Chart ReadChart(const std::string& name_or_file);

/// Reading of one patch in a photograph.
struct PatchReading {
  glm::dvec3 mean{0.0};   ///< over its middle, in the photograph's linear values
  double spread = 0;      ///< relative standard deviation over the patch, largest of the channels
  double saturated = 0;   ///< fraction of pixels
  std::string damage;     ///< why it must not be used; empty: nothing wrong with it
  glm::dvec2 corners[4];  ///< of the part that was read, in pixels
};

/// Outer corners of the outer patches: top left, top right, bottom right, bottom left of the upright chart.
using ChartCorners = std::array<glm::dvec2, 4>;

/// Reads every patch's middle. `gap`: between patches, as a fraction of a patch; `margin`: fraction of a patch left out
/// along each side. Marks patches that are saturated, or uneven beyond noise.
std::vector<PatchReading> ReadPatches(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap,
                                      const glm::dvec3& saturation, double margin = 0.25);

/// Nearby corners for which the patches are most even. Detectors miss by a tenth of a patch, and by more on small
/// charts.
ChartCorners RefineCorners(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap);

}  // namespace crownfit
