#include "capture/rigid_transform.h"

#include <algorithm>
#include <cmath>

namespace crownfit {

glm::dmat3 RotationFromVector(const glm::dvec3& vector) {
  const double angle = glm::length(vector);
  if (angle == 0) return glm::dmat3(1.0);
  const glm::dvec3 a = vector / angle;
  const glm::dmat3 cross(glm::dvec3(0, a.z, -a.y), glm::dvec3(-a.z, 0, a.x), glm::dvec3(a.y, -a.x, 0));
  return glm::dmat3(1.0) + std::sin(angle) * cross + (1.0 - std::cos(angle)) * cross * cross;
}

JsonValue VectorJson(const glm::dvec3& v) { return std::vector<double>{v.x, v.y, v.z}; }

JsonValue::Object RigidTransformJson(const RigidTransform& t) {
  JsonValue::Array rows;
  for (int r = 0; r < 3; ++r) rows.emplace_back(VectorJson({t.rotation[0][r], t.rotation[1][r], t.rotation[2][r]}));
  return {{"rotation", rows}, {"translation_mm", VectorJson(t.translation_mm)}};
}

glm::dvec3 ReadVector(const JsonNode& node) {
  const auto v = node.Numbers(3);
  return {v[0], v[1], v[2]};
}

glm::dvec3 ReadPlace(const JsonNode& node) {
  const glm::dvec3 v = ReadVector(node);
  if (glm::length(v) > kFarthestPlace_mm) node.Fail("the vector is longer than 100 m", "Give lengths in mm.");
  return v;
}

glm::dvec3 ReadUnitVector(const JsonNode& node) {
  const glm::dvec3 v = ReadVector(node);
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (largest < 1e-12) node.Fail("the direction has no length");
  return glm::normalize(v * std::exp2(-std::ilogb(largest)));  // exact, and no square overflows
}

RigidTransform ReadRigidTransform(const JsonNode& node) {
  const JsonObject object(node, {"rotation", "translation_mm", "covariance", "stddev"});
  RigidTransform transform;
  const JsonNode rotation = object.Require("rotation");
  const auto rows = rotation.Items();
  if (rows.size() != 3) rotation.Fail("expected 3 rows of 3 numbers, found " + std::to_string(rows.size()) + " rows");
  for (int r = 0; r < 3; ++r) {
    const auto row = rows[r].Numbers(3);
    for (int c = 0; c < 3; ++c) transform.rotation[c][r] = row[c];
  }
  const glm::dmat3 gram = glm::transpose(transform.rotation) * transform.rotation;
  double worst = std::abs(glm::determinant(transform.rotation) - 1.0);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(gram[c][r] - (r == c ? 1.0 : 0.0)));
  if (worst > 1e-3)
    rotation.Fail("this is not a rotation (its columns must be orthonormal, its determinant +1)",
                  "Give the rotation matrix of camera_from_object row by row, without scale: scale the mesh instead.");
  transform.translation_mm = ReadVector(object.Require("translation_mm"));
  return transform;
}

}  // namespace crownfit
