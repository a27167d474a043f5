#pragma once
// Rotations and translations between frames, named target_from_source.

#include <glm/glm.hpp>

#include "base/json_file.h"

namespace crownfit {

/// point_in_a = a_from_b * point_in_b. `rotation` is stored in columns (GLM).
struct RigidTransform {
  glm::dmat3 rotation{1.0};
  glm::dvec3 translation_mm{0.0};
  bool operator==(const RigidTransform&) const = default;
  glm::dvec3 Point(const glm::dvec3& p) const { return rotation * p + translation_mm; }
  glm::dvec3 Direction(const glm::dvec3& d) const { return rotation * d; }
  RigidTransform Inverse() const {
    const glm::dmat3 back = glm::transpose(rotation);
    return {back, -(back * translation_mm)};
  }
};

/// First b, then a.
inline RigidTransform operator*(const RigidTransform& a, const RigidTransform& b) {
  return {a.rotation * b.rotation, a.Point(b.translation_mm)};
}

/// A rotation about `vector` by its length in radians (Rodrigues).
glm::dmat3 RotationFromVector(const glm::dvec3& vector);

/// Reads {"rotation": 3 rows of 3, "translation_mm": [x, y, z]}; refuses what is not a rotation (to 1e-3).
RigidTransform ReadRigidTransform(const JsonNode& node);

/// The same as JSON.
JsonValue::Object RigidTransformJson(const RigidTransform& transform);
JsonValue VectorJson(const glm::dvec3& v);

/// Limit for objects and lights: rays are single precision, a step is 0.008 mm there.
inline constexpr double kFarthestPlace_mm = 1e5;

glm::dvec3 ReadVector(const JsonNode& node);      ///< three finite numbers
glm::dvec3 ReadPlace(const JsonNode& node);       ///< a vector in mm, not longer than kFarthestPlace_mm
glm::dvec3 ReadUnitVector(const JsonNode& node);  ///< three numbers, not all 0, normalised

}  // namespace crownfit
