#include "geometry/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crownfit {
namespace {

std::vector<glm::dvec3> In3D(const std::vector<glm::dvec2>& flat) {
  const glm::dvec3 u = glm::normalize(glm::dvec3(1, 2, -1)), n = glm::normalize(glm::cross(u, glm::dvec3(0, 1, 1))),
                   v = glm::cross(n, u);
  std::vector<glm::dvec3> corners;
  for (const glm::dvec2& p : flat) corners.push_back(glm::dvec3(1, 2, 3) + p.x * u + p.y * v);
  return corners;
}

double Shoelace(const std::vector<glm::dvec2>& p) {
  double sum = 0;
  for (size_t i = 0; i < p.size(); ++i) {
    const glm::dvec2 &a = p[i], &b = p[(i + 1) % p.size()];
    sum += 0.5 * (a.x * b.y - a.y * b.x);
  }
  return sum;
}

/// Sum of the triangles' areas, which is the polygon's only if none overlap and none lie outside.
double AreaOf(const std::vector<glm::dvec3>& corners, const std::vector<std::array<int, 3>>& triangles) {
  double sum = 0;
  for (const auto& t : triangles)
    sum += 0.5 * glm::length(glm::cross(corners[t[1]] - corners[t[0]], corners[t[2]] - corners[t[0]]));
  return sum;
}

const std::vector<glm::dvec2> kU{{-4, -4.1},  {4, -4},  {4.1, 4},    {2, 4.2},
                                 {1.7, -1.8}, {-2, -2}, {-1.8, 3.8}, {-4.2, 4}};

TEST(Polygons, AreaMatchesTheShoelaceFormula) {
  std::vector<glm::dvec2> gear;  // 200 teeth
  for (int i = 0; i < 400; ++i) {
    const double r = i % 2 ? 5.0 : 3.0, a = 2 * std::numbers::pi * i / 400;
    gear.emplace_back(r * std::cos(a), r * std::sin(a));
  }
  for (const auto& outline :
       {kU, gear, std::vector<glm::dvec2>{{0, 0}, {4, 0}, {4, 3}, {0, 3}},
        std::vector<glm::dvec2>{{0, 0}, {2, 0}, {4, 0}, {4, 3}, {2, 3}, {0, 3}, {0, 1}},  // corners on straight edges
        std::vector<glm::dvec2>{{-4, -4}, {0, -1}, {4, -4}, {0, 5}}}) {
    const auto corners = In3D(outline);
    const auto triangles = Triangulated(corners);
    ASSERT_TRUE(triangles);
    EXPECT_EQ(triangles->size(), outline.size() - 2);
    EXPECT_NEAR(AreaOf(corners, *triangles), Shoelace(outline), 1e-9);
  }
}

TEST(Polygons, CornersRoundedOffAStraightEdgeGiveNoSlivers) {
  for (const double off : {1e-7, -1e-7, 1e-5, -1e-5}) {
    std::vector<glm::dvec2> outline{{0, 0}, {0.5, off}, {1, 0}, {0, 6}};
    for (size_t first = 0; first < outline.size(); ++first) {
      const auto corners = In3D(outline);
      const auto triangles = Triangulated(corners);
      ASSERT_TRUE(triangles);
      ASSERT_EQ(triangles->size(), 2u);
      for (const auto& t : *triangles) EXPECT_NEAR(AreaOf(corners, {t}), 1.5, 1e-4) << off << " " << first;  // halves
      std::rotate(outline.begin(), outline.begin() + 1, outline.end());
    }
  }
}

TEST(Polygons, FirstCornerDoesNotChangeAWarpedSurface) {
  for (const size_t corner_count : {4u, 8u}) {
    std::vector<glm::dvec3> corners;
    for (size_t i = 0; i < corner_count; ++i)
      corners.emplace_back(kU[i].x, kU[i].y, 0.3 * std::sin(5.0 * static_cast<double>(i)));
    double first = 0;
    for (size_t k = 0; k < corner_count; ++k) {
      const auto triangles = Triangulated(corners);
      ASSERT_TRUE(triangles);
      const double area = AreaOf(corners, *triangles);
      if (k == 0) first = area;
      EXPECT_NEAR(area, first, 1e-9) << corner_count << " corners, " << k;
      std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    }
  }
}

TEST(Polygons, SelfIntersectingOutlinesAreRefused) {
  std::vector<glm::dvec2> pentagram;
  for (int i = 0; i < 5; ++i)
    pentagram.emplace_back(std::cos(4 * std::numbers::pi * i / 5), std::sin(4 * std::numbers::pi * i / 5));
  EXPECT_FALSE(Triangulated(In3D(pentagram)));
  EXPECT_FALSE(Triangulated(In3D({{-4, -4}, {4, 4}, {4, -4}, {-4, 4}})));
  EXPECT_FALSE(Triangulated(In3D({{0, 0}, {1, 0}, {2, 0}, {3, 0}}))) << "no area";
}

TEST(Polygons, HolesReachedByABridgeStayOpen) {
  const std::vector<glm::dvec2> frame{{0, 0}, {6, 0}, {6, 6}, {0, 6}, {0, 0}, {2, 2}, {2, 4}, {4, 4}, {4, 2}, {2, 2}};
  const auto corners = In3D(frame);
  const auto triangles = Triangulated(corners);
  ASSERT_TRUE(triangles);
  EXPECT_NEAR(AreaOf(corners, *triangles), 36.0 - 4.0, 1e-9);
}

TEST(Polygons, RepeatedCornersGiveTrianglesWithoutArea) {
  const auto corners = In3D({{0, 0}, {3, 0}, {3, 0}, {0, 4}});
  const auto triangles = Triangulated(corners);
  ASSERT_TRUE(triangles);
  EXPECT_NEAR(AreaOf(corners, *triangles), 6.0, 1e-9);
}

}  // namespace
}  // namespace crownfit
