#include "scene/touching_layers.h"

#include <gtest/gtest.h>

#include "geometry/signed_distance.h"
#include "scene/build_crown.h"
#include "support/known_scene.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

/// The inner mesh after it was separated from the outer one.
TriangleMesh Separated(const TriangleMesh& outer, const TriangleMesh& inner, std::vector<std::string>* said = nullptr) {
  std::vector<std::optional<TriangleMesh>> meshes{outer, inner};
  std::vector<std::string> messages;
  SeparateTouchingLayers(meshes, {"enamel", "dentine"}, 1, messages);
  EXPECT_EQ(meshes[0]->vertices, outer.vertices) << "the outer layer stays";
  if (said) *said = messages;
  return *meshes[1];
}

TEST(TouchingLayers, InnerSurfaceEndsOutsideWhereItCoincides) {
  const TriangleMesh ball = Refined(Sphere(4.0, 24), 0.5);
  std::vector<std::string> said;
  const TriangleMesh inner = Separated(ball, ball, &said);
  const RayCaster caster({&ball});
  for (const glm::dvec3& v : inner.vertices) {
    EXPECT_FALSE(IsInside(caster, ball, v));
    EXPECT_NEAR(caster.DistanceToSurface(v), 4e-3, 1e-3);
  }
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("mm2 of their surfaces in common"), std::string::npos) << said[0];
}

TEST(TouchingLayers, CommonAreaIsThatOfTheSharedFaces) {
  const TriangleMesh outer = Refined(Box({-5, -5, 0}, {5, 5, 2}), 0.5),
                     inner = Refined(Box({-3, -2, 1}, {3, 2, 2}), 0.5);
  std::vector<std::string> said;
  const TriangleMesh moved = Separated(outer, inner, &said);
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find(" 24 mm2 "), std::string::npos) << said[0];
  for (size_t v = 0; v < moved.vertices.size(); ++v) {
    if (inner.vertices[v].z < 2.0)
      EXPECT_EQ(moved.vertices[v], inner.vertices[v]) << "not in common";
    else
      EXPECT_GT(moved.vertices[v].z, 2.002);
  }
}

TEST(TouchingLayers, FilmsAndGapsThatRaysResolveStay) {
  const TriangleMesh outer = Refined(Box({-5, -5, 0}, {5, 5, 2}), 0.5);
  for (const double top : {1.999, 1.9, 2.05}) {
    const TriangleMesh inner = Refined(Box({-3, -2, 1}, {3, 2, top}), 0.5);
    std::vector<std::string> said;
    EXPECT_EQ(Separated(outer, inner, &said).vertices, inner.vertices) << top;
    EXPECT_TRUE(said.empty());
  }
}

TEST(TouchingLayers, OfThreeThatCoincideEachEndsBeyondTheOneAbove) {
  const TriangleMesh ball = Sphere(4.0, 24);
  std::vector<std::optional<TriangleMesh>> meshes{ball, ball, ball};
  std::vector<std::string> messages;
  SeparateTouchingLayers(meshes, {"a", "b", "c"}, 1, messages);
  const RayCaster second({&*meshes[1]});
  for (const glm::dvec3& v : meshes[2]->vertices) EXPECT_FALSE(IsInside(second, *meshes[1], v));
}

TEST(TouchingLayers, ObjectsAreAsDeepUnderAnInnerLayerThatStandsOutAHair) {
  // The outer top ends at 1.5 mm below the inner one's; some of its triangles reach under that.
  const TriangleMesh outer = Refined(Box({-4, -4, 0}, {4, 4, 1.5}), 2.0);
  for (const double proud : {3e-3, 0.05}) {
    KnownScene scene(outer, 2);
    scene.source.meshes[1] = Refined(Box({-3.9, -3.9, 0.2}, {3.9, 3.9, 1.5 + proud}), 2.0);
    const auto crown = scene.Build();
    int tops = 0;
    for (size_t v = 0; v < crown->fine.vertices.size(); ++v) {
      const glm::dvec3& p = crown->fine.vertices[v];
      if (p.z < 1.5 + 0.5 * proud) continue;
      ++tops;
      EXPECT_GT(crown->columns[v].straight.total_mm, 1.5) << "chord at " << p.x << ", " << p.y;
    }
    EXPECT_GT(tops, 100);
  }
}

}  // namespace
}  // namespace crownfit
