#pragma once
// Finds a ColorChecker in a photograph (OpenCV's mcc).

#include <optional>

#include "calibration/colour_chart.h"
#include "photo/image_io.h"

namespace crownfit {

inline constexpr double kClassicGap = 0.1;  ///< between patches, as OpenCV lays the Classic out

/// Corners of the 24 patches' outline, as ReadPatches wants them: those whose patches are most like `chart`'s, among
/// what OpenCV finds on the picture at several sizes. `linear`: the same picture in linear values. Nothing when no
/// chart is found. Charts may be turned by any angle.
std::optional<ChartCorners> FindClassicChart(const ImageFile& photo, const Image& linear, const Chart& chart);

}  // namespace crownfit
