#pragma once
// Poses from a scan's own outlines as a file, with an overlay for inspection.

#include <string>
#include <vector>

#include "calibration/align_scan.h"
#include "calibration/product.h"

namespace crownfit {

/// poses.json of photographs aligned together or one by one: `aligned` has one entry for all of them, or one for each.
/// The picture shows every photograph with the contours at its start (red) and at the result (green).
Product ScanPosesProduct(const TriangleMesh& mesh, const std::vector<std::string>& names,
                         const std::vector<ScanPhotograph>& photographs, const std::vector<AlignedScan>& aligned);

}  // namespace crownfit
