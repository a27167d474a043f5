#pragma once
// The pose of a scanned crown or arch in photographs, from its own outlines: no markers.
//
// Region stage (after PWP3D, Prisacariu and Reid 2012): colours inside and around the rough pose separate the object
// from its surroundings. A search over poses makes the rendered object cover its colours. Edge stage (after RAPID,
// Harris and Stennett 1990): outlines and the lines between crowns are moved along their normals onto the edges in the
// photograph, by robust least squares.

#include <array>
#include <functional>
#include <vector>

#include "calibration/scan_photograph.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

struct AlignOptions {
  double search_mm = 5, search_deg = 5;  ///< standard deviation of the random starts
  int starts = 300;
  uint64_t seed = 1;
  int threads = 0;
};

struct AlignedScan {
  std::vector<RigidTransform> camera_from_object;
  /// Of each photograph's pose, as in StatedPose; includes the starts' covariance where several are aligned together.
  std::vector<std::array<double, 36>> covariance;
  double larger = 0, larger_stddev = 0;  ///< fraction by which the object appears larger than its mesh
  double from_start = 0;         ///< distance over three standard deviations of the search: 1 and more is too far
  std::vector<double> rms_px;    ///< robust, of matched contour points to their edges
  std::vector<double> matched;   ///< fraction of contour points that found an edge
  std::vector<double> contrast;  ///< how well colours separate inside from outside: 0 not at all, 1 entirely
};

/// One motion of the object for all photographs: the starts must be right relative to each other. For independent
/// poses, call it once for each photograph.
AlignedScan AlignScan(const TriangleMesh& mesh, const std::vector<ScanPhotograph>& photographs,
                      const AlignOptions& options, const std::function<void(double)>& progress = {});

}  // namespace crownfit
