#pragma once
// Rays against triangles. Embree is named in ray_caster.cpp only.

#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace crownfit {

inline constexpr double kFar = std::numeric_limits<double>::infinity();

struct Hit {
  double distance_mm;
  int mesh;  ///< index into the list the caster was built from
  SurfacePoint point;
};

/// Immutable after construction; safe to use from several threads. Embree computes in single precision: positions are
/// good to about 1e-6 of the scene's size.
class RayCaster {
 public:
  explicit RayCaster(const std::vector<const TriangleMesh*>& meshes);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// Nearest hit with min < distance < max; `direction` is a unit vector.
  std::optional<Hit> Nearest(const glm::dvec3& origin, const glm::dvec3& direction, double min_mm = 0.0,
                             double max_mm = kFar) const;
  /// Nearest hit that `accepts` (a predicate of mesh and triangle) accepts; rejected hits do not block.
  template <class Accepts>
  std::optional<Hit> NearestAccepted(const glm::dvec3& origin, const glm::dvec3& direction, double max_mm,
                                     const Accepts& accepts) const {
    return NearestAccepted(
        origin, direction, max_mm,
        [](const void* f, int mesh, int triangle) { return (*static_cast<const Accepts*>(f))(mesh, triangle); },
        &accepts);
  }
  bool Occluded(const glm::dvec3& origin, const glm::dvec3& direction, double min_mm = 0.0, double max_mm = kFar) const;
  /// Distance to the nearest triangle, computed in double precision on that triangle; infinite when there is none
  /// `within_mm`. A known bound saves most of the work.
  double DistanceToSurface(const glm::dvec3& point, double within_mm = kFar) const;
  /// The nearest point of the first mesh.
  SurfacePoint ClosestPoint(const glm::dvec3& point) const;

 private:
  using Predicate = bool (*)(const void* state, int mesh, int triangle);
  std::optional<Hit> NearestAccepted(const glm::dvec3& origin, const glm::dvec3& direction, double max_mm,
                                     Predicate predicate, const void* state) const;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace crownfit
