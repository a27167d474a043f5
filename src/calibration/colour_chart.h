#pragma once
// Colour charts: what their patches are, and what a photograph shows of them.

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

/// One of those, or a file ("crownfit-chart/1").
Chart ReadChart(const std::string& name_or_file);

/// What a photograph shows of one patch.
struct PatchReading {
  glm::dvec3 mean{0.0};   ///< of its middle, in the photograph's linear values
  double spread = 0;      ///< standard deviation over the patch over its mean, largest of the channels
  double saturated = 0;   ///< share of pixels
  std::string damage;     ///< why it is not to be used; empty: nothing wrong with it
  glm::dvec2 corners[4];  ///< of the part that was read, in pixels
};

/// Of the outer patches' outer corners: top left, top right, bottom right, bottom left as the chart is meant to stand.
using ChartCorners = std::array<glm::dvec2, 4>;

/// Reads every patch's middle. `gap`: between patches, as a share of a patch; `margin`: share of a patch left out along
/// each side. Patches that are saturated, or uneven beyond noise, are marked.
std::vector<PatchReading> ReadPatches(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap,
                                      const glm::dvec3& saturation, double margin = 0.25);

/// Corners nearby for which the patches are most even. Detectors miss by a tenth of a patch, and more on small charts.
ChartCorners RefineCorners(const Image& linear, const Chart& chart, const ChartCorners& corners, double gap);

}  // namespace crownfit
