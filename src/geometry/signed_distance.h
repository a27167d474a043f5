#pragma once
// The distance inward from a closed surface, on a grid, and its level surfaces: the inward offsets that separate
// layers.

#include <functional>
#include <optional>

#include "geometry/ray_caster.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Depth below a closed surface at the nodes of a regular grid: > 0 inside, < 0 outside. Depth is measured from the
/// scanned surface: at an open scan's neck the layers continue below, almost to the cut.
class DepthField {
 public:
  /// Grid step: the larger of 0.06 mm and 1/150 of the mesh's diagonal.
  DepthField(const TriangleMesh& mesh, int threads);

  double max_depth_mm() const { return max_depth_mm_; }

  /// The closed surface at a depth that may vary from place to place. Its vertices lie at that depth to 1e-3 mm, except
  /// on the ridges where the inward offset has edges. Dual contouring by surface nets (Gibson 1998). Absent when
  /// nothing is that deep.
  std::optional<TriangleMesh> LevelSurface(const std::function<double(const glm::dvec3&)>& depth_mm) const;
  std::optional<TriangleMesh> LevelSurface(double depth_mm) const {
    return LevelSurface([=](const glm::dvec3&) { return depth_mm; });
  }

 private:
  size_t IndexOf(int i, int j, int k) const { return (static_cast<size_t>(k) * size_.y + j) * size_.x + i; }
  double at(int i, int j, int k) const { return depth_mm_[IndexOf(i, j, k)]; }
  TriangleMesh scanned_, cut_;
  RayCaster scanned_caster_, cut_caster_;
  glm::dvec3 origin_;
  double step_mm_;
  glm::ivec3 size_;
  std::vector<float> depth_mm_;
  std::vector<float> above_cut_mm_;  ///< as depth, from the cut alone; empty without one
  double max_depth_mm_ = 0;
  int threads_ = 0;
};

/// True when `point` lies inside the closed surface (majority of three rays; Embree's robust mode leaves no cracks).
bool IsInside(const RayCaster& surface, const TriangleMesh& mesh, const glm::dvec3& point);

}  // namespace crownfit
