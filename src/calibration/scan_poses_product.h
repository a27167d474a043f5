#pragma once
// Poses from a scan's own outlines as a file, with an overlay to look at.

#include <string>
#include <vector>

#include "calibration/align_scan.h"
#include "calibration/product.h"

namespace crownfit {

/// poses.json of photographs that were aligned together or one by one: `aligned` has one entry with all of them, or one
/// for each. The picture shows every photograph with the contours at its start (red) and where they came to lie
/// (green).
Product ScanPosesProduct(const TriangleMesh& mesh, const std::vector<std::string>& names,
                         const std::vector<ScanPhotograph>& photographs, const std::vector<AlignedScan>& aligned);

}  // namespace crownfit
