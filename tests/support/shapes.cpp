#include "support/shapes.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace crownfit {
namespace {

constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// Closes a stack of equally long rings, given from bottom to top, counter-clockwise seen from the top.
TriangleMesh Stack(const std::vector<std::vector<glm::dvec3>>& rings) {
  TriangleMesh mesh;
  const int n = static_cast<int>(rings[0].size());
  for (const auto& ring : rings) mesh.vertices.insert(mesh.vertices.end(), ring.begin(), ring.end());
  for (int k = 0; k + 1 < static_cast<int>(rings.size()); ++k) {
    for (int i = 0; i < n; ++i) {
      const int a = k * n + i, b = k * n + (i + 1) % n;
      mesh.triangles.emplace_back(a, b, b + n);
      mesh.triangles.emplace_back(a, b + n, a + n);
    }
  }
  const auto cap = [&](int ring, bool up) {
    glm::dvec3 centre(0.0);
    for (const auto& p : rings[ring]) centre += p / static_cast<double>(n);
    mesh.vertices.push_back(centre);
    const int c = static_cast<int>(mesh.vertices.size()) - 1;
    for (int i = 0; i < n; ++i) {
      const int a = ring * n + i, b = ring * n + (i + 1) % n;
      mesh.triangles.emplace_back(up ? glm::ivec3(a, b, c) : glm::ivec3(b, a, c));
    }
  };
  cap(0, false);
  cap(static_cast<int>(rings.size()) - 1, true);
  return mesh;
}

}  // namespace

TriangleMesh Sphere(double radius, int rings) {
  std::vector<std::vector<glm::dvec3>> stack;
  for (int k = 1; k < rings; ++k) {
    const double theta = std::numbers::pi * (1.0 - static_cast<double>(k) / rings);
    std::vector<glm::dvec3> ring;
    for (int i = 0; i < 2 * rings; ++i) {
      const double a = kTwoPi * i / (2 * rings);
      ring.push_back(radius *
                     glm::dvec3(std::sin(theta) * std::cos(a), std::sin(theta) * std::sin(a), std::cos(theta)));
    }
    stack.push_back(ring);
  }
  TriangleMesh mesh = Stack(stack);
  mesh.vertices[mesh.vertices.size() - 2] = {0, 0, -radius};
  mesh.vertices.back() = {0, 0, radius};
  return mesh;
}

TriangleMesh OpenBelow(const TriangleMesh& mesh, double above) {
  TriangleMesh open;
  open.vertices = mesh.vertices;
  for (auto& v : open.vertices) v.z = std::max(v.z, above);
  for (const auto& t : mesh.triangles)
    if (std::max({mesh.vertices[t.x].z, mesh.vertices[t.y].z, mesh.vertices[t.z].z}) > above)
      open.triangles.push_back(t);
  return open;
}

TriangleMesh Cup(double radius, double height, double wall, int sides) {
  std::vector<std::vector<glm::dvec3>> stack;
  const auto ring = [&](double r, double z) {
    stack.emplace_back();
    for (int i = 0; i < sides; ++i) {
      const double a = kTwoPi * i / sides;
      stack.back().emplace_back(r * std::cos(a), r * std::sin(a), z);
    }
  };
  ring(0.5 * radius, -0.5 * height);
  ring(radius, -0.5 * height);
  ring(radius, 0.5 * height);
  ring(radius - wall, 0.5 * height);
  ring(radius - wall, wall - 0.5 * height);
  ring(0.5 * (radius - wall), wall - 0.5 * height);
  return Stack(stack);
}

TriangleMesh Disc(double thickness, double radius, int sides) {
  std::vector<std::vector<glm::dvec3>> stack;
  for (const auto& [z, r] :
       {std::pair{-thickness, 0.5 * radius}, {-thickness, radius}, {0.0, radius}, {0.0, 0.5 * radius}}) {
    std::vector<glm::dvec3> ring;
    for (int i = 0; i < sides; ++i)
      ring.emplace_back(r * std::cos(kTwoPi * i / sides), r * std::sin(kTwoPi * i / sides), z);
    stack.push_back(ring);
  }
  return Stack(stack);
}

TriangleMesh Box(const glm::dvec3& low, const glm::dvec3& high) {
  std::vector<std::vector<glm::dvec3>> stack;
  for (double z : {low.z, high.z})
    stack.push_back({{low.x, low.y, z}, {high.x, low.y, z}, {high.x, high.y, z}, {low.x, high.y, z}});
  return Stack(stack);
}

TriangleMesh GridBox(const glm::dvec3& low, const glm::dvec3& high, int cells, int top_cells) {
  TriangleMesh mesh;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3, sign = face % 2 ? 1 : -1;
    const int n = axis == 2 && sign > 0 ? top_cells : cells, first = static_cast<int>(mesh.vertices.size());
    for (int i = 0; i <= n; ++i)
      for (int k = 0; k <= n; ++k) {
        glm::dvec3 share(0.5 + 0.5 * sign);
        share[u] = static_cast<double>(i) / n;
        share[v] = static_cast<double>(sign > 0 ? k : n - k) / n;
        mesh.vertices.push_back(low + share * (high - low));
      }
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        const int a = first + i * (n + 1) + k, b = a + n + 1;
        mesh.triangles.emplace_back(a, b, b + 1);
        mesh.triangles.emplace_back(a, b + 1, a + 1);
      }
  }
  return mesh;
}

TriangleMesh Incisor(int levels) {
  const int sides = 4 * levels / 3;
  std::vector<std::vector<glm::dvec3>> stack;
  for (int k = 0; k <= levels; ++k) {
    const double u = static_cast<double>(k) / levels, y = -5.0 + 10.0 * u;
    double half_width = 3.1 + 1.1 * std::sin(0.5 * std::numbers::pi * std::min(1.0, 1.15 * u));
    double half_depth = 0.65 + 2.4 * std::pow(1.0 - u, 1.2);
    // Rounded corners at the edge, a blunt edge, and a rounded neck.
    const auto arc = [](double t) { return std::sqrt(1.0 - (1.0 - t) * (1.0 - t)); };
    const double corner = std::clamp((1.0 - u) / 0.22, 0.0, 1.0), edge = std::clamp((1.0 - u) / 0.06, 0.0, 1.0);
    const double neck = std::clamp(u / 0.08, 0.0, 1.0);
    half_width *= (0.62 + 0.38 * arc(corner)) * (0.75 + 0.25 * arc(neck));
    half_depth *= (0.25 + 0.75 * arc(edge)) * (0.75 + 0.25 * arc(neck));
    const double bulge = 0.5 * std::sin(std::numbers::pi * u), power = 2.3;
    std::vector<glm::dvec3> ring;
    for (int i = 0; i < sides; ++i) {
      const double a = -kTwoPi * i / sides, c = std::cos(a), s = std::sin(a);
      const double r = std::pow(std::pow(std::abs(c), power) + std::pow(std::abs(s), power), -1.0 / power);
      ring.emplace_back(half_width * r * c, y, bulge + half_depth * r * s);
    }
    stack.push_back(ring);
  }
  return Stack(stack);
}

}  // namespace crownfit
