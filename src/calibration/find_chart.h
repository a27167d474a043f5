#pragma once
// Finds a ColorChecker in a photograph (OpenCV's mcc).

#include <optional>

#include "calibration/colour_chart.h"
#include "photo/image_io.h"

namespace crownfit {

inline constexpr double kClassicGap = 0.1;  ///< between patches, as OpenCV lays the Classic out

/// Corners of the 24 patches' outline, as ReadPatches expects them. Of the charts that OpenCV finds on the picture at
/// several sizes, takes the one whose patches are most like `chart`'s. `linear`: the same picture in linear values.
/// Absent when no chart is found. Charts may be rotated by any angle.
std::optional<ChartCorners> FindClassicChart(const ImageFile& photo, const Image& linear, const Chart& chart);

}  // namespace crownfit
