#pragma once
// A layer's thickness that varies over the crown: zones along the long axis, numbers at the vertices, unevenness of the
// junction.

#include <memory>

#include "capture/layer_spec.h"
#include "geometry/ray_caster.h"
#include "geometry/triangle_mesh.h"
#include "scene/long_axis.h"

namespace crownfit {

struct Capture;

class ThicknessMap {
 public:
  /// `mesh`: the layer's own, null when it is an offset itself; `outer`: the crown's outer surface. Both must outlive
  /// the map. Throws InputError: a property that the mesh lacks, zones without a long axis.
  ThicknessMap(const Capture& capture, size_t layer, const TriangleMesh* mesh, const TriangleMesh& outer);

  /// At the point of the junction that belongs to `p`; `thickness` is the layer's thickness_mm, or its thickness_scale
  /// where a field defines the thickness.
  double At(const glm::dvec3& p, double thickness) const;

 private:
  double FieldAt(const glm::dvec3& p) const;
  std::optional<ThicknessField> field_;
  std::vector<glm::dvec4> waves_;  ///< of the junction noise: wave vector and phase; empty without noise
  double amplitude_mm_ = 0;
  std::optional<LongAxis> axis_;  ///< of zones
  const TriangleMesh* mesh_ = nullptr;
  const std::vector<double>* property_ = nullptr;
  RayCaster caster_{{}};
};

}  // namespace crownfit
