#pragma once
// The pose of a scanned crown or arch in photographs, from its own outlines: no markers.
//
// Region first (after PWP3D, Prisacariu and Reid 2012): colours inside and around the rough pose tell object from
// surroundings, and a search over poses makes the rendered object cover the former. Then edges (after RAPID, Harris and
// Stennett 1990): outlines and the lines between crowns are brought onto the edges that the photograph shows along
// their normals, by robust least squares.

#include <array>
#include <functional>
#include <vector>

#include "calibration/scan_photograph.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

struct AlignOptions {
  double search_mm = 5, search_deg = 5;  ///< standard deviation of the starts that are tried
  int starts = 300;
  uint64_t seed = 1;
  int threads = 0;
};

struct AlignedScan {
  std::vector<RigidTransform> camera_from_object;
  /// Of each photograph's pose, as in StatedPose; with what the starts state, where several are aligned together.
  std::vector<std::array<double, 36>> covariance;
  double larger = 0, larger_stddev = 0;  ///< by which share the object looks larger than its mesh
  double from_start = 0;                 ///< over three times what was to be searched: 1 and more is too far
  std::vector<double> rms_px;            ///< of matched contour points to their edges, robust
  std::vector<double> matched;           ///< share of contour points that found an edge
  std::vector<double> contrast;          ///< how well colours tell inside from outside: 0 not at all, 1 entirely
};

/// One motion of the object, the same for all photographs: the starts are right relative to each other. For poses that
/// are independent, call it once for each photograph.
AlignedScan AlignScan(const TriangleMesh& mesh, const std::vector<ScanPhotograph>& photographs,
                      const AlignOptions& options, const std::function<void(double)>& progress = {});

}  // namespace crownfit
