#include "geometry/light_samples.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "geometry/triangle_mesh.h"

namespace crownfit {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Centres of n x n strata of the unit square.
std::vector<glm::dvec2> Strata(int n) {
  std::vector<glm::dvec2> points;
  for (int row = 0; row < n; ++row)
    for (int column = 0; column < n; ++column) points.emplace_back((column + 0.5) / n, (row + 0.5) / n);
  return points;
}

glm::dvec3 InFrame(const glm::dvec3& axis, double cosine, double angle) {
  const auto [u, v] = Tangents(axis);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return sine * std::cos(angle) * u + sine * std::sin(angle) * v + cosine * axis;
}

/// Uniform over a cone; a surface facing it receives `irradiance`.
void SampleCone(const glm::dvec3& axis, double radius, const glm::dvec3& irradiance, double distance,
                const std::vector<glm::dvec2>& points, std::vector<LightSample>& out) {
  const double edge = std::cos(radius);
  const glm::dvec3 weight = irradiance * (2.0 / (1.0 + edge)) / static_cast<double>(points.size());
  for (const auto& p : points)
    out.push_back({InFrame(axis, 1.0 - p.x * (1.0 - edge), 2 * kPi * p.y), distance, weight});
}

/// A point on a flat lamp that shines along `normal`: weight = L cos' dA / d^2.
void AddAreaSample(const glm::dvec3& from, const glm::dvec3& on_lamp, const glm::dvec3& normal,
                   const glm::dvec3& radiance, double area, std::vector<LightSample>& out) {
  const glm::dvec3 way = on_lamp - from;
  const double distance = glm::length(way), cosine = -glm::dot(way, normal) / distance;
  if (!(cosine > 0)) return;
  out.push_back({way / distance, distance, radiance * (cosine * area / (distance * distance))});
}

struct Sampler {
  glm::dvec3 point, normal;
  const std::vector<glm::dvec2>& points;
  std::vector<LightSample>& out;

  void operator()(const DirectionalLight& l) const {
    SampleCone(l.direction, l.angular_radius, l.irradiance, kInfinite, points, out);
  }
  void operator()(const PointLight& l) const {
    const glm::dvec3 way = l.position_mm - point;
    const double d = glm::length(way);
    SampleCone(way / d, std::asin(std::min(1.0, l.radius_mm / d)), l.radiant_intensity / (d * d), d, points, out);
  }
  void operator()(const DiskLight& l) const {
    const auto [u, v] = Tangents(l.normal);
    const double r0 = l.inner_radius_mm * l.inner_radius_mm, r1 = l.outer_radius_mm * l.outer_radius_mm;
    for (const auto& p : points) {
      const double r = std::sqrt(r0 + p.x * (r1 - r0)), a = 2 * kPi * p.y;
      AddAreaSample(point, l.centre_mm + r * std::cos(a) * u + r * std::sin(a) * v, l.normal, l.radiance,
                    kPi * (r1 - r0) / static_cast<double>(points.size()), out);
    }
  }
  void operator()(const RectangleLight& l) const {
    const glm::dvec3 cross = glm::cross(l.half_axis_u_mm, l.half_axis_v_mm);
    const double area = 4.0 * glm::length(cross) / static_cast<double>(points.size());
    for (const auto& p : points)
      AddAreaSample(point, l.centre_mm + (2 * p.x - 1) * l.half_axis_u_mm + (2 * p.y - 1) * l.half_axis_v_mm,
                    glm::normalize(cross), l.radiance, area, out);
  }
  void operator()(const DomeLight& l) const {
    for (const auto& p : points) {
      const double cosine = std::sqrt(1.0 - p.x);
      out.push_back({InFrame(normal, cosine, 2 * kPi * p.y), kInfinite,
                     l.radiance * (kPi / (cosine * static_cast<double>(points.size())))});
    }
  }
};

}  // namespace

void SampleLight(const LightShape& light, const glm::dvec3& point, const glm::dvec3& normal, int strata,
                 std::vector<LightSample>& out) {
  std::visit(Sampler{point, normal, Strata(strata), out}, light);
}

void SampleDomeForGloss(const DomeLight& dome, const glm::dvec3& normal, const glm::dvec3& view, double roughness,
                        int strata, std::vector<LightSample>& out) {
  const double a2 = roughness * roughness;
  const auto gloss_density = [&](const glm::dvec3& l) {
    const glm::dvec3 h = glm::normalize(l + view);
    const double c = glm::dot(h, normal), lh = glm::dot(l, h);
    if (c <= 0 || lh <= 1e-6) return 0.0;
    const double b = (1 - c * c) + a2 * c * c;
    return a2 / (kPi * b * b) * c / (4 * lh);
  };
  const auto add = [&](const glm::dvec3& l) {
    const double cosine = glm::dot(l, normal);
    if (cosine <= 1e-4) return;
    const double count = static_cast<double>(strata) * strata;
    out.push_back({l, kInfinite, dome.radiance / (count * (cosine / kPi + gloss_density(l)))});
  };
  for (const auto& p : Strata(strata)) add(InFrame(normal, std::sqrt(1.0 - p.x), 2 * kPi * p.y));
  for (const auto& p : Strata(strata)) {
    const double c = std::sqrt((1.0 - p.x) / (1.0 + (a2 - 1.0) * p.x));  // GGX normals, Walter et al. 2007, eq. 35
    const glm::dvec3 h = InFrame(normal, c, 2 * kPi * p.y);
    add(2.0 * glm::dot(view, h) * h - view);
  }
}

}  // namespace crownfit
