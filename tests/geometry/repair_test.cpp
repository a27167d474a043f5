// Repairs of a surface: closed forms, and the same result for any order of the file.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <random>

#include "base/error.h"
#include "geometry/mesh_file.h"
#include "support/shapes.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

TriangleMesh Reread(const TriangleMesh& mesh, std::vector<std::string>* said = nullptr) {
  const TemporaryFolder folder;
  WritePly(folder.path / "m.ply", mesh);
  std::vector<std::string> messages;
  const TriangleMesh read = ReadClosedSurface(folder.path / "m.ply", messages);
  if (said) *said = messages;
  return read;
}

TriangleMesh Together(TriangleMesh a, const TriangleMesh& b) {
  const int count = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles) a.triangles.push_back(t + count);
  return a;
}

TriangleMesh InsideOut(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t.y, t.z);
  return mesh;
}

TriangleMesh Moved(TriangleMesh mesh, const glm::dvec3& by) {
  for (auto& v : mesh.vertices) v += by;
  return mesh;
}

TEST(Shells, EveryBodyFacesOutwards) {
  const TriangleMesh big = Sphere(4.0, 16), small = Moved(Sphere(1.5, 12), {8, 0, 0});
  const double volume = Volume(big) + Volume(small);
  for (const auto& mesh :
       {Together(big, InsideOut(small)), Together(InsideOut(big), small), Together(InsideOut(big), InsideOut(small))}) {
    std::vector<std::string> said;
    EXPECT_NEAR(Volume(Reread(mesh, &said)), volume, 1e-4);
    ASSERT_EQ(said.size(), 1u);
    EXPECT_NE(said[0].find("inside out"), std::string::npos) << said[0];
  }
}

TEST(Shells, NestedBodiesAlternateBetweenSolidAndCavity) {
  const TriangleMesh outer = Sphere(5.0, 16), hollow = Sphere(3.0, 16), core = Sphere(1.5, 12);
  for (const auto& inner : {hollow, InsideOut(hollow)})
    for (const auto& innermost : {core, InsideOut(core)})
      EXPECT_NEAR(Volume(Reread(Together(Together(outer, inner), innermost))),
                  Volume(outer) - Volume(hollow) + Volume(core), 1e-4);
}

TEST(Shells, BodiesThatShareAFaceAreMerged) {
  const TriangleMesh left = Box({0, 0, 0}, {2, 3, 4});
  TriangleMesh right = InsideOut(left);  // a mirror image, so that both triangulate the wall equally
  for (auto& v : right.vertices) v.x = 2.0 + 1.5 * (2.0 - v.x);
  std::vector<std::string> said;
  const TriangleMesh both = Reread(Together(left, right), &said);
  EXPECT_NEAR(Volume(both), 5.0 * 3 * 4, 1e-9);
  EXPECT_NEAR(Area(both), 2 * (5.0 * 3 + 3 * 4 + 4 * 5), 1e-9) << "without the wall between them";
}

TEST(Shells, NonOrientableSurfaceIsRefused) {
  TriangleMesh band;
  constexpr int kSteps = 40;
  for (int i = 0; i < kSteps; ++i)
    for (const double s : {-1.0, 1.0}) {
      const double a = 2 * std::numbers::pi * i / kSteps, half = 0.5 * a;
      const double r = 5.0 + s * std::cos(half);
      band.vertices.emplace_back(r * std::cos(a), r * std::sin(a), s * std::sin(half));
    }
  for (int i = 0; i < kSteps; ++i) {
    const int a = 2 * i, b = 2 * i + 1, last = i + 1 == kSteps;
    const int c = last ? 1 : 2 * i + 2, d = last ? 0 : 2 * i + 3;  // a half turn
    band.triangles.emplace_back(a, b, c);
    band.triangles.emplace_back(b, d, c);
  }
  try {
    Reread(band);
    FAIL() << "a Moebius band was read";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("only one side"), std::string::npos) << e.what();
  }
}

/// A surface as the sorted list of its triangles' corners, each from its lowest corner on.
std::vector<std::array<float, 9>> Canonical(const TriangleMesh& mesh) {
  std::vector<std::array<float, 9>> faces;
  for (const auto& t : mesh.triangles) {
    std::array<std::array<float, 3>, 3> corners;
    for (int k = 0; k < 3; ++k)
      for (int axis = 0; axis < 3; ++axis) corners[k][axis] = static_cast<float>(mesh.vertices[t[k]][axis]);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    std::array<float, 9> face;
    for (int k = 0; k < 9; ++k) face[k] = corners[k / 3][k % 3];
    faces.push_back(face);
  }
  std::sort(faces.begin(), faces.end());
  return faces;
}

TriangleMesh Shuffled(const TriangleMesh& mesh, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<int> place(mesh.vertices.size());
  std::iota(place.begin(), place.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  TriangleMesh shuffled = mesh;
  for (size_t v = 0; v < place.size(); ++v) shuffled.vertices[place[v]] = mesh.vertices[v];
  std::shuffle(shuffled.triangles.begin(), shuffled.triangles.end(), random);
  for (auto& t : shuffled.triangles) {
    t = {place[t.x], place[t.y], place[t.z]};
    for (auto turns = random() % 3; turns > 0; --turns) t = {t.y, t.z, t.x};
  }
  return shuffled;
}

TEST(Repairs, OrderInTheFileDoesNotMatter) {
  // An open scan with two holes that meet in a vertex, a double face, turned faces, and an island inside out.
  TriangleMesh worn = OpenBelow(Sphere(4.0, 24), -2.0);
  const int hub = worn.triangles[700].x;
  std::vector<size_t> around;
  for (size_t t = 0; t < worn.triangles.size(); ++t)
    if (worn.triangles[t].x == hub || worn.triangles[t].y == hub || worn.triangles[t].z == hub) around.push_back(t);
  ASSERT_EQ(around.size(), 6u);
  std::vector<size_t> gone{around[0], around[3]};
  for (const size_t t : around) {  // not a neighbour of the first: they share the hub alone
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) shared += worn.triangles[t][i] == worn.triangles[around[0]][k];
    if (shared == 1) gone[1] = t;
  }
  worn.triangles.push_back(worn.triangles[100]);
  for (size_t t = 0; t < worn.triangles.size(); t += 7) std::swap(worn.triangles[t].y, worn.triangles[t].z);
  std::sort(gone.begin(), gone.end());
  worn.triangles.erase(worn.triangles.begin() + static_cast<long>(gone[1]));
  worn.triangles.erase(worn.triangles.begin() + static_cast<long>(gone[0]));
  worn = Together(worn, InsideOut(Moved(Sphere(1.0, 8), {7, 0, 0})));

  std::vector<std::string> said;
  const auto expected = Canonical(Reread(worn, &said));
  EXPECT_EQ(said.size(), 6u);  // loose vertices, a double face, turned faces, a body, the neck, holes
  for (const unsigned seed : {1u, 2u, 3u}) {
    std::vector<std::string> said_again;
    EXPECT_TRUE(Canonical(Reread(Shuffled(worn, seed), &said_again)) == expected) << seed;
    EXPECT_EQ(said_again, said);
  }
}

/// Turned out of the axes, so that no corner lies on a line without rounding.
TriangleMesh Turned(TriangleMesh mesh) {
  const glm::dvec3 x = glm::normalize(glm::dvec3(3, 1, -2)), y = glm::normalize(glm::cross({1, 1, 1}, x));
  for (auto& v : mesh.vertices) v = glm::dmat3(x, y, glm::cross(x, y)) * v;
  return mesh;
}

/// Closed without holes, with an area on every face: by Euler, V - F / 2 = 2.
void ExpectWholeBox(const TriangleMesh& box, const glm::dvec3& size, const std::string& what) {
  EXPECT_EQ(2 * box.vertices.size() - box.triangles.size(), 4u) << what;
  EXPECT_NEAR(Volume(box), size.x * size.y * size.z, 1e-4) << what;
  EXPECT_NEAR(Area(box), 2 * (size.x * size.y + size.y * size.z + size.z * size.x), 1e-4) << what;
  for (const glm::ivec3& t : box.triangles) {
    const glm::dvec3 a = box.vertices[t.y] - box.vertices[t.x], b = box.vertices[t.z] - box.vertices[t.x];
    ASSERT_GT(glm::length(glm::cross(a, b)), 1e-4 * glm::length(a) * glm::length(b)) << what;
  }
}

TEST(Cracks, FinerFaceBecomesOneWithItsCoarseNeighbours) {
  for (const auto& [cells, top_cells] : {std::pair{4, 8}, {8, 4}, {1, 12}, {3, 5}, {1, 100}}) {
    std::vector<std::string> said;
    const TriangleMesh box = Reread(Turned(GridBox({-4, -4, -3}, {4, 4, 3}, cells, top_cells)), &said);
    ExpectWholeBox(box, {8, 8, 6}, std::to_string(cells) + " and " + std::to_string(top_cells));
    ASSERT_EQ(said.size(), 1u);
    EXPECT_NE(said[0].find("lay on a neighbour's edge"), std::string::npos) << said[0];
  }
}

TEST(Cracks, CoversWithoutAreaAreNotNeeded) {
  TriangleMesh mesh = GridBox({-4, -4, -3}, {4, 4, 3}, 1, 4);
  const auto vertex = [&](double x, double y) {
    return static_cast<int>(std::find(mesh.vertices.begin(), mesh.vertices.end(), glm::dvec3(x, y, 3)) -
                            mesh.vertices.begin());
  };
  for (const double x : {-4.0, 4.0}) {  // fans from one end of each edge, and from one corner to the next
    mesh.triangles.emplace_back(vertex(x, -4), vertex(x, -2), vertex(x, 0));
    mesh.triangles.emplace_back(vertex(x, -4), vertex(x, 0), vertex(x, 2));
    mesh.triangles.emplace_back(vertex(x, -4), vertex(x, 2), vertex(x, 4));
    mesh.triangles.emplace_back(vertex(-4, x), vertex(-2, x), vertex(4, x));
    mesh.triangles.emplace_back(vertex(-2, x), vertex(0, x), vertex(4, x));
    mesh.triangles.emplace_back(vertex(0, x), vertex(2, x), vertex(4, x));
  }
  std::vector<std::string> said;
  ExpectWholeBox(Reread(Turned(mesh), &said), {8, 8, 6}, "turned");
  ExpectWholeBox(Reread(mesh), {8, 8, 6}, "exactly flat");
  ASSERT_EQ(said.size(), 2u);
  EXPECT_NE(said[0].find("12 triangles without area"), std::string::npos) << said[0];
}

TEST(Cracks, OrderInTheFileDoesNotMatter) {
  const TriangleMesh mesh = Turned(GridBox({-4, -4, -3}, {4, 4, 3}, 2, 7));
  const auto expected = Canonical(Reread(mesh));
  for (const unsigned seed : {1u, 2u, 3u}) EXPECT_TRUE(Canonical(Reread(Shuffled(mesh, seed))) == expected) << seed;
}

}  // namespace
}  // namespace crownfit
