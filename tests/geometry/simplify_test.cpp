// A simplified surface is the same body with fewer triangles.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "geometry/triangle_mesh.h"
#include "support/shapes.h"

namespace crownfit {
namespace {

/// Whether every edge is walked as often in either direction.
bool IsClosed(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> walked;
  for (const glm::ivec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++walked[{t[k], t[(k + 1) % 3]}];
  return std::all_of(walked.begin(), walked.end(), [&](const auto& edge) {
    const auto back = walked.find({edge.first.second, edge.first.first});
    return back != walked.end() && back->second == edge.second;
  });
}

TEST(Simplified, ClosedSurfacesKeepTheirShape) {
  const TriangleMesh sphere = Refined(Sphere(10.0, 24), 0.5);
  const TriangleMesh simple = Simplified(sphere, sphere.triangles.size() / 8);
  EXPECT_TRUE(IsClosed(sphere));
  EXPECT_LE(simple.triangles.size(), sphere.triangles.size() / 8);
  EXPECT_TRUE(IsClosed(simple));
  EXPECT_NEAR(Volume(simple) / Volume(sphere), 1.0, 0.01);
  EXPECT_NEAR(Area(simple) / Area(sphere), 1.0, 0.01);
}

TEST(Simplified, TheEdgeOfACutStaysWhole) {
  TriangleMesh sphere = Refined(Sphere(10.0, 24), 0.5);
  for (size_t t = 0; t < sphere.triangles.size(); ++t) {
    double z = 0;
    for (int k = 0; k < 3; ++k) z += sphere.vertices[sphere.triangles[t][k]].z / 3;
    sphere.is_cut.push_back(z < -5.0);
  }
  const TriangleMesh simple = Simplified(sphere, sphere.triangles.size() / 8);
  EXPECT_LT(simple.triangles.size(), sphere.triangles.size() / 4);
  EXPECT_TRUE(IsClosed(simple));
  EXPECT_NEAR(Area(CutPart(simple)) / Area(CutPart(sphere)), 1.0, 0.02);
  EXPECT_NEAR(Area(ScannedPart(simple)) / Area(ScannedPart(sphere)), 1.0, 0.02);
}

TEST(Simplified, SmallMeshesStayAsTheyAre) {
  const TriangleMesh sphere = Sphere(10.0, 24);
  EXPECT_EQ(Simplified(sphere, sphere.triangles.size()).vertices, sphere.vertices);
}

}  // namespace
}  // namespace crownfit
