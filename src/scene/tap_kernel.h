#pragma once
// Where light is gathered around a point of the crown, to blur it.

#include <vector>

#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Offsets at which irradiance is gathered around a point to blur it: groups of taps ("rings") at similar distances.
struct TapKernel {
  struct Offset {
    glm::dvec2 mm;
    int ring;
  };
  std::vector<Offset> offsets;
  std::vector<double> outer_radius_mm;  ///< of every ring but the last, which reaches to infinity
  int rings() const { return static_cast<int>(outer_radius_mm.size()) + 1; }
};

/// How many taps each ring has, those beyond an object's edge included.
std::vector<int> TapsPerRing(const TapKernel& kernel);

/// Centre and 6 rings of 8 taps from 0.15 to 4.8 mm. shader/twelve_taps.h has the thesis's kernel.
TapKernel ConvergedKernel();

/// Three vertices of the fine mesh and their weights.
struct Interpolation {
  int vertices[3] = {-1, -1, -1};
  float weights[3] = {0, 0, 0};
  bool exists() const { return vertices[0] >= 0; }
};

struct Tap {
  int ring;
  Interpolation front, opposite;
  bool beyond_neck = false;  ///< below the cut of a scan, where the root is lit as the tooth is here
};

/// Interpolation of vertex values at a place of the fine mesh; none where there is no place.
Interpolation InterpolationAt(const TriangleMesh& mesh, const SurfacePoint& p);

}  // namespace crownfit
