#include "scene/light_samples.h"

#include <algorithm>
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

/// The cone under which a directional or a point light is seen. Its radiance is uniform.
struct LightCone {
  glm::dvec3 axis;
  Spectrum radiance;
  double edge_cosine, distance_mm;
  double density() const { return 1.0 / (2 * kPi * (1.0 - edge_cosine)); }
};

/// A surface that faces the cone receives `irradiance`. A light without size becomes a cone of 1e-4 rad.
LightCone ConeOf(const glm::dvec3& axis, double sine, const Spectrum& irradiance, double distance) {
  const double s2 = std::clamp(sine * sine, 1e-8, 1.0);
  return {axis, irradiance / (kPi * s2), std::sqrt(1.0 - s2), distance};
}
LightCone ConeOf(const DirectionalLight& l, const glm::dvec3&) {
  return ConeOf(l.direction, std::sin(l.angular_radius), l.irradiance, kInfinite);
}
LightCone ConeOf(const PointLight& l, const glm::dvec3& from) {
  const glm::dvec3 way = l.position_mm - from;
  const double d = glm::length(way);
  return ConeOf(way / d, std::min(1.0, l.radius_mm / d), l.radiant_intensity / (d * d), d);
}

/// A flat lamp: a point of its plane, and its area.
struct FlatLamp {
  glm::dvec3 centre, normal;
  const Spectrum& radiance;
  double area;
};
FlatLamp FlatOf(const DiskLight& l) {
  const double r0 = l.inner_radius_mm, r1 = l.outer_radius_mm;
  return {l.centre_mm, l.normal, l.radiance, kPi * (r1 * r1 - r0 * r0)};
}
FlatLamp FlatOf(const RectangleLight& l) {
  const glm::dvec3 cross = glm::cross(l.half_axis_u_mm, l.half_axis_v_mm);
  return {l.centre_mm, glm::normalize(cross), l.radiance, 4.0 * glm::length(cross)};
}
glm::dvec3 PointOn(const DiskLight& l, const glm::dvec2& p) {
  const auto [u, v] = Tangents(l.normal);
  const double r0 = l.inner_radius_mm * l.inner_radius_mm, r1 = l.outer_radius_mm * l.outer_radius_mm;
  const double r = std::sqrt(r0 + p.x * (r1 - r0)), a = 2 * kPi * p.y;
  return l.centre_mm + r * std::cos(a) * u + r * std::sin(a) * v;
}
glm::dvec3 PointOn(const RectangleLight& l, const glm::dvec2& p) {
  return l.centre_mm + (2 * p.x - 1) * l.half_axis_u_mm + (2 * p.y - 1) * l.half_axis_v_mm;
}
bool Covers(const DiskLight& l, const glm::dvec3& from_centre) {
  const double r2 = glm::dot(from_centre, from_centre);
  return r2 >= l.inner_radius_mm * l.inner_radius_mm && r2 <= l.outer_radius_mm * l.outer_radius_mm;
}
bool Covers(const RectangleLight& l, const glm::dvec3& from_centre) {
  const glm::dvec3 cross = glm::cross(l.half_axis_u_mm, l.half_axis_v_mm);
  const double square = glm::dot(cross, cross);
  const double a = glm::dot(glm::cross(from_centre, l.half_axis_v_mm), cross) / square,
               b = glm::dot(glm::cross(l.half_axis_u_mm, from_centre), cross) / square;
  return std::abs(a) <= 1.0 && std::abs(b) <= 1.0;
}

template <class Shape>
concept Flat = requires(const Shape& shape) {
  FlatOf(shape);
};

struct PointSampler {
  const glm::dvec3& from;
  const glm::dvec2& p;
  template <class Shape>
  std::optional<LightPoint> operator()(const Shape& l) const {
    const LightCone cone = ConeOf(l, from);
    return LightPoint{InFrame(cone.axis, 1.0 - p.x * (1.0 - cone.edge_cosine), 2 * kPi * p.y), cone.distance_mm,
                      cone.radiance, cone.density()};
  }
  template <Flat Shape>
  std::optional<LightPoint> operator()(const Shape& l) const {
    const FlatLamp lamp = FlatOf(l);
    const glm::dvec3 way = PointOn(l, p) - from;
    const double d2 = glm::dot(way, way), d = std::sqrt(d2), cosine = -glm::dot(way, lamp.normal) / d;
    if (!(cosine > 0)) return std::nullopt;
    return LightPoint{way / d, d, lamp.radiance, d2 / (cosine * lamp.area)};
  }
  std::optional<LightPoint> operator()(const DomeLight& l) const {
    return LightPoint{InFrame({0, 0, 1}, 1.0 - 2.0 * p.x, 2 * kPi * p.y), kInfinite, l.radiance, 0.25 / kPi};
  }
  std::optional<LightPoint> operator()(const EnvironmentLight& l) const {
    const glm::dvec3 in_map = l.map->Sample(p);
    return LightPoint{glm::transpose(l.map_from_frame) * in_map, kInfinite, l.scale * l.map->Radiance(in_map),
                      l.map->Density(in_map)};
  }
};

struct RayMeeting {
  const glm::dvec3 &from, &direction;
  template <class Shape>
  std::optional<LightPoint> operator()(const Shape& l) const {
    const LightCone cone = ConeOf(l, from);
    if (glm::dot(direction, cone.axis) < cone.edge_cosine) return std::nullopt;
    return LightPoint{direction, cone.distance_mm, cone.radiance, cone.density()};
  }
  template <Flat Shape>
  std::optional<LightPoint> operator()(const Shape& l) const {
    const FlatLamp lamp = FlatOf(l);
    const double cosine = -glm::dot(direction, lamp.normal);
    if (!(cosine > 0)) return std::nullopt;
    const double d = glm::dot(from - lamp.centre, lamp.normal) / cosine;
    if (!(d > 0) || !Covers(l, from + d * direction - lamp.centre)) return std::nullopt;
    return LightPoint{direction, d, lamp.radiance, d * d / (cosine * lamp.area)};
  }
  std::optional<LightPoint> operator()(const DomeLight& l) const {
    return LightPoint{direction, kInfinite, l.radiance, 0.25 / kPi};
  }
  std::optional<LightPoint> operator()(const EnvironmentLight& l) const {
    const glm::dvec3 in_map = l.map_from_frame * direction;
    return LightPoint{direction, kInfinite, l.scale * l.map->Radiance(in_map), l.map->Density(in_map)};
  }
};

}  // namespace

std::optional<LightPoint> SampleLightPoint(const LightShape& light, const glm::dvec3& from, const glm::dvec2& uniform) {
  return std::visit(PointSampler{from, uniform}, light);
}

std::optional<LightPoint> LightAlong(const LightShape& light, const glm::dvec3& from, const glm::dvec3& direction) {
  return std::visit(RayMeeting{from, direction}, light);
}

void SampleLight(const LightShape& light, const glm::dvec3& point, const glm::dvec3& normal, int strata,
                 std::vector<LightSample>& out) {
  if (const auto* map = std::get_if<EnvironmentLight>(&light)) {
    for (const auto& lamp : map->map->FarLamps(static_cast<size_t>(strata) * strata))
      out.push_back({glm::transpose(map->map_from_frame) * lamp.direction, kInfinite, map->scale * lamp.irradiance});
    return;
  }
  const double count = static_cast<double>(strata) * strata;
  const auto* dome = std::get_if<DomeLight>(&light);
  for (const auto& p : Strata(strata)) {
    if (dome) {  // cosine-distributed about the normal
      const double cosine = std::sqrt(1.0 - p.x);
      out.push_back({InFrame(normal, cosine, 2 * kPi * p.y), kInfinite, dome->radiance * (kPi / (cosine * count))});
    } else if (const auto sample = SampleLightPoint(light, point, p)) {
      out.push_back({sample->direction, sample->distance_mm, sample->radiance / (sample->density * count)});
    }
  }
}

void SampleAllAroundForGloss(const LightShape& light, const glm::dvec3& normal, const glm::dvec3& view,
                             double roughness, int strata, std::vector<LightSample>& out) {
  constexpr double kLeastCosine = 1e-3;  // as the lobe's
  constexpr double kLeastHeight = 1e-4;
  const double a2 = roughness * roughness, cos_view = std::max(kLeastCosine, glm::dot(view, normal));
  const auto tangents = Tangents(normal);
  const glm::dvec3 &u = tangents.first, &v = tangents.second;
  const auto gloss_density = [&](const glm::dvec3& l) {
    const double c = glm::dot(glm::normalize(l + view), normal);
    if (c <= 0) return 0.0;
    const double b = (1 - c * c) + a2 * c * c;
    return a2 / (kPi * b * b) / (2.0 * (cos_view + std::sqrt(a2 + (1.0 - a2) * cos_view * cos_view)));
  };
  // Samples the visible facets (Heitz 2018), so that no sample outweighs the lobe, however low the camera.
  const glm::dvec3 stretched =
      glm::normalize(glm::dvec3(roughness * glm::dot(view, u), roughness * glm::dot(view, v), cos_view));
  const double level = std::hypot(stretched.x, stretched.y);
  const glm::dvec3 t1 = level > 0 ? glm::dvec3(-stretched.y, stretched.x, 0.0) / level : glm::dvec3(1, 0, 0);
  const glm::dvec3 t2 = glm::cross(stretched, t1);
  const auto facet = [&](const glm::dvec2& p) {
    const double r = std::sqrt(p.x), x = r * std::cos(2 * kPi * p.y), half = 0.5 * (1.0 + stretched.z);
    const double y = (1.0 - half) * std::sqrt(1.0 - x * x) + half * r * std::sin(2 * kPi * p.y);
    const glm::dvec3 n = x * t1 + y * t2 + std::sqrt(std::max(0.0, 1.0 - x * x - y * y)) * stretched;
    return glm::normalize(roughness * n.x * u + roughness * n.y * v + std::max(0.0, n.z) * normal);
  };
  const auto* environment = std::get_if<EnvironmentLight>(&light);
  std::vector<const EnvironmentMap::FarLamp*> small;  // samples would hit these by chance only: whole lamps
  if (environment) {
    constexpr double kSmall = 0.5;  // radius over roughness; the lobe of mirrored light is twice as wide
    for (const auto& lamp : environment->map->FarLamps(size_t{4} * strata * strata)) {
      if (lamp.radius_rad > kSmall * roughness) continue;
      small.push_back(&lamp);
      const glm::dvec3 direction = glm::transpose(environment->map_from_frame) * lamp.direction;
      if (glm::dot(direction, normal) > kLeastHeight)
        out.push_back({direction, kInfinite, environment->scale * lamp.irradiance});
    }
  }
  const auto is_taken = [&](const glm::dvec3& l) {
    if (small.empty()) return false;
    const glm::dvec2 place = EnvironmentMap::PlaceOf(environment->map_from_frame * l);
    return std::any_of(small.begin(), small.end(), [&](const auto* lamp) { return lamp->Holds(place); });
  };
  const auto add = [&](const glm::dvec3& l) {
    const double cosine = glm::dot(l, normal);
    if (cosine <= kLeastHeight || is_taken(l)) return;
    const double count = static_cast<double>(strata) * strata;
    const auto met = LightAlong(light, glm::dvec3(0.0), l);
    out.push_back({l, kInfinite, met->radiance / (count * (cosine / kPi + gloss_density(l)))});
  };
  for (const auto& p : Strata(strata)) add(InFrame(normal, std::sqrt(1.0 - p.x), 2 * kPi * p.y));
  for (const auto& p : Strata(strata)) {
    const glm::dvec3 h = facet(p);
    add(2.0 * glm::dot(view, h) * h - view);
  }
}

}  // namespace crownfit
