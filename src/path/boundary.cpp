#include "path/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "geometry/triangle_mesh.h"
#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {
namespace {

using Term = Terms<double>;

/// Direction behind a boundary; `from` points away from it, `normal` to the side of `from`. Not beyond the critical
/// angle.
glm::dvec3 Refracted(const glm::dvec3& from, const glm::dvec3& normal, double relative_ior) {
  const double c = glm::dot(from, normal);
  const double inside = std::sqrt(std::max(0.0, 1.0 - (1.0 - c * c) / (relative_ior * relative_ior)));
  return glm::normalize((c / relative_ior - inside) * normal - from / relative_ior);
}

/// Between indices this similar, light continues straight whatever the facet's slope. Half vectors (their length is the
/// index step) and densities would consist of rounding errors.
bool BendsNothing(double relative_ior) { return std::abs(relative_ior - 1.0) <= kSameIndex; }

glm::dvec3 Mirrored(const glm::dvec3& from, const glm::dvec3& normal) {
  return glm::normalize(2.0 * glm::dot(from, normal) * normal - from);
}

/// The GGX microsurface, heights uniform in [-1, 1], seen from above. Vectors from below come in mirrored (-w).
struct Microsurface {
  double alpha;

  double Lambda(const glm::dvec3& w) const {
    if (w.z > 0.9999999) return 0.0;
    if (w.z < -0.9999999) return -1.0;
    const double tan2 = (1.0 - w.z * w.z) / (w.z * w.z);
    const double root = std::sqrt(1.0 + alpha * alpha * tan2);
    return w.z > 0 ? 0.5 * (root - 1.0) : 0.5 * (-root - 1.0);
  }
  /// Projected area of the facets seen from w (Heitz 2014): for w below the horizon, of those that still face it.
  double ProjectedArea(const glm::dvec3& w) const {
    return 0.5 * (w.z + std::sqrt(w.z * w.z + alpha * alpha * (1.0 - w.z * w.z)));
  }
  double VisibleNormals(const glm::dvec3& w, const glm::dvec3& m) const {
    const double cosine = glm::dot(w, m), area = ProjectedArea(w);
    if (cosine <= 0 || m.z <= 0 || area <= 0) return 0.0;
    return Term::GgxDistribution(m.z, alpha) * cosine / area;
  }
  /// Dupuy and Benyoub 2023, also valid for w below the horizon.
  glm::dvec3 SampleVisibleNormal(const glm::dvec3& w, RandomStream& random) const {
    const glm::dvec3 s = glm::normalize(glm::dvec3(alpha * w.x, alpha * w.y, w.z));
    const double angle = 2.0 * std::numbers::pi * random.Next();
    const double z = (1.0 - random.Next()) * (1.0 + s.z) - s.z;
    const double sine = std::sqrt(std::max(0.0, 1.0 - z * z));
    const glm::dvec3 h = glm::dvec3(sine * std::cos(angle), sine * std::sin(angle), z) + s;
    return glm::normalize(glm::dvec3(alpha * h.x, alpha * h.y, std::max(h.z, 1e-12)));
  }
  static double Below(double height) { return std::clamp(0.5 * (height + 1.0), 0.0, 1.0); }
  /// Share of light that leaves upwards along w from `height` without hitting another facet.
  double Unmasked(const glm::dvec3& w, double height) const {
    if (w.z <= 0) return 0.0;
    return std::pow(Below(height), Lambda(w));
  }
  /// Height of the next facet along w, infinite when there is none.
  double NextHeight(const glm::dvec3& w, double height, RandomStream& random) const {
    const double u = random.Next();
    if (std::abs(w.z) < 1e-9) return height;
    const double lambda = Lambda(w);
    if (w.z > 0 && (lambda <= 0 || u >= 1.0 - std::pow(Below(height), lambda))) return HUGE_VAL;
    return std::clamp(2.0 * Below(height) * std::pow(1.0 - u, -1.0 / lambda) - 1.0, -1.0, 1.0);
  }
  /// Density with which a single facet scatters from `from` to `to`; both vectors point away from the surface.
  double OneFacet(const glm::dvec3& from, const glm::dvec3& to, double relative_ior, bool above, bool to_above) const {
    const double side = above ? 1.0 : -1.0, eta = above ? relative_ior : 1.0 / relative_ior;
    if (above == to_above) {
      const glm::dvec3 m = glm::normalize(from + to) * side;
      const double cosine = glm::dot(from, m) * side;
      if (!(cosine > 1e-12)) return 0.0;
      return 0.25 * VisibleNormals(from * side, m) / cosine * Term::FresnelReflectance(cosine, eta);
    }
    glm::dvec3 m = from + to * eta;
    const double length = glm::length(m);
    if (!(length > 1e-12)) return 0.0;
    m *= (m.z > 0 ? 1.0 : -1.0) / length;  // upwards
    const double in = glm::dot(from, m) * side, out = -glm::dot(to, m) * side;
    if (in <= 0 || out <= 0) return 0.0;
    const double jacobian = in - eta * out;
    return eta * eta * (1.0 - Term::FresnelReflectance(in, eta)) * VisibleNormals(from * side, m) * out /
           (jacobian * jacobian);
  }
  /// Density of leaving along `to` after one facet, with masking averaged over heights; `from` is above.
  double FirstBounce(const glm::dvec3& from, const glm::dvec3& to, double relative_ior) const {
    return OneFacet(from, to, relative_ior, true, to.z > 0) / (1.0 + Lambda(to.z > 0 ? to : -to));
  }
};

/// Transforms into the boundary's local frame and back; z is `normal`.
struct Frame {
  glm::dvec3 u, v, n;
  explicit Frame(const glm::dvec3& normal) : n(normal) { std::tie(u, v) = Tangents(normal); }
  glm::dvec3 Into(const glm::dvec3& w) const { return {glm::dot(w, u), glm::dot(w, v), glm::dot(w, n)}; }
  glm::dvec3 OutOf(const glm::dvec3& w) const { return glm::normalize(w.x * u + w.y * v + w.z * n); }
};

constexpr size_t kMaxTargets = 32;

}  // namespace

glm::dvec3 ScatterAtSmoothBoundary(const glm::dvec3& direction, const glm::dvec3& normal, double relative_ior,
                                   RandomStream& random) {
  const glm::dvec3 n = glm::dot(direction, normal) < 0 ? normal : -normal;
  if (BendsNothing(relative_ior)) return direction;
  const double reflectance = Term::FresnelReflectance(-glm::dot(direction, n), relative_ior);
  return random.Next() < reflectance ? Mirrored(-direction, n) : Refracted(-direction, n, relative_ior);
}

Scattered ScatterOnMicrosurface(const glm::dvec3& from, double relative_ior, double roughness, RandomStream& random,
                                std::span<const glm::dvec3> targets, std::span<TargetDensity> densities) {
  const Microsurface surface{roughness};
  for (size_t k = 0; k < targets.size(); ++k)
    densities[k].approximate = surface.FirstBounce(from, targets[k], relative_ior);
  constexpr int kEndless = 10000;  // no light stays that long; guards against rounding at the horizon
  glm::dvec3 w = -from;
  bool above = true;
  double height = 1.0;
  for (int bounce = 0; bounce < kEndless; ++bounce) {
    height = above ? surface.NextHeight(w, height, random) : -surface.NextHeight(-w, -height, random);
    if (std::isinf(height)) return {w, surface.FirstBounce(from, w, relative_ior)};
    for (size_t k = 0; k < targets.size(); ++k) {
      const bool to_above = targets[k].z > 0;
      const double unmasked = to_above ? surface.Unmasked(targets[k], height) : surface.Unmasked(-targets[k], -height);
      if (unmasked > 0)
        densities[k].estimate += unmasked * surface.OneFacet(-w, targets[k], relative_ior, above, to_above);
    }
    const glm::dvec3 m = above ? surface.SampleVisibleNormal(-w, random) : -surface.SampleVisibleNormal(w, random);
    const double eta = above ? relative_ior : 1.0 / relative_ior;
    if (random.Next() < Term::FresnelReflectance(-glm::dot(w, m), eta)) {
      w = Mirrored(-w, m);
    } else {
      w = Refracted(-w, m, eta);
      above = !above;
    }
  }
  return {Mirrored(from, {0, 0, 1}), kMirror};
}

Scattered OuterBoundary::Scatter(const glm::dvec3& direction, const glm::dvec3& normal, RandomStream& random,
                                 std::span<const glm::dvec3> targets, std::span<TargetDensity> densities) const {
  for (TargetDensity& d : densities) d = {};
  if (wetness > 0 && random.Next() < wetness) return ScatterUnderFilm(direction, normal, random, targets, densities);
  const bool outside = glm::dot(direction, normal) < 0;
  const double relative_ior = outside ? inside_ior / outside_ior : outside_ior / inside_ior;
  if (BendsNothing(relative_ior)) return {direction, kMirror};
  if (is_smooth()) return {ScatterAtSmoothBoundary(direction, normal, relative_ior, random), kMirror};
  const Frame frame(outside ? normal : -normal);
  std::array<glm::dvec3, kMaxTargets> local;
  for (size_t k = 0; k < targets.size(); ++k) local[k] = frame.Into(targets[k]);
  glm::dvec3 from = frame.Into(-direction);
  from.z = std::max(from.z, 1e-9);
  const Scattered s =
      ScatterOnMicrosurface(from, relative_ior, roughness, random, {local.data(), targets.size()}, densities);
  return {frame.OutOf(s.direction), s.density};
}

/// Smooth film surface above, rough boundary below, no distance between them: light is reflected back and forth until
/// it leaves on either side. Densities are approximated by the first visit to the rough boundary.
Scattered OuterBoundary::ScatterUnderFilm(const glm::dvec3& direction, const glm::dvec3& normal, RandomStream& random,
                                          std::span<const glm::dvec3> targets,
                                          std::span<TargetDensity> densities) const {
  const glm::dvec3 up(0, 0, 1);
  const double into_film = kFilmIor / outside_ior, into_layer = inside_ior / kFilmIor;
  const bool is_mirror = is_smooth() || BendsNothing(into_layer);
  const Frame frame(normal);
  const auto out_of_film = [&](double cosine_outside, double cosine_film) {  // transmittance x d(solid angle)
    return (1.0 - Term::FresnelReflectance(cosine_outside, into_film)) * cosine_outside /
           (into_film * into_film * std::max(cosine_film, 1e-9));
  };
  std::array<glm::dvec3, kMaxTargets> inner, local;  // targets as seen from inside the film, and mirrored by `flip`
  std::array<double, kMaxTargets> passed;
  std::array<TargetDensity, kMaxTargets> visit;
  for (size_t k = 0; k < targets.size(); ++k) {
    const glm::dvec3 t = frame.Into(targets[k]);
    inner[k] = -Refracted(t, up, into_film);
    passed[k] = out_of_film(t.z, inner[k].z);
  }
  glm::dvec3 w = frame.Into(direction);
  bool in_layer = w.z > 0;
  if (!in_layer) {
    if (random.Next() < Term::FresnelReflectance(-w.z, into_film)) return {frame.OutOf(Mirrored(-w, up)), kMirror};
    w = Refracted(-w, up, into_film);
  }
  const double first_flip = in_layer ? -1.0 : 1.0, first_ior = in_layer ? 1.0 / into_layer : into_layer;
  const glm::dvec3 first_from = -w * first_flip;
  for (bool is_first = true;; is_first = false) {
    // At the rough boundary; `flip` mirrors directions so that light comes from above.
    const double flip = in_layer ? -1.0 : 1.0, ior = in_layer ? 1.0 / into_layer : into_layer;
    glm::dvec3 from = -w * flip;
    from.z = std::max(from.z, 1e-9);
    if (is_mirror) {
      w = flip * ScatterAtSmoothBoundary(-from, up, ior, random);
    } else {
      for (size_t k = 0; k < targets.size(); ++k) {
        local[k] = inner[k] * flip;
        visit[k] = {};
      }
      w = flip * ScatterOnMicrosurface(from, ior, roughness, random, {local.data(), targets.size()},
                                       {visit.data(), targets.size()})
                     .direction;
      for (size_t k = 0; k < targets.size(); ++k) {
        densities[k].estimate += passed[k] * visit[k].estimate;
        if (is_first) densities[k].approximate = passed[k] * visit[k].approximate;
      }
    }
    if (w.z < 0) return {frame.OutOf(w), kMirror};  // into the layer, which holds no lamp
    if (random.Next() >= Term::FresnelReflectance(w.z, 1.0 / into_film)) {
      const glm::dvec3 out = Refracted(-w, -up, 1.0 / into_film);
      const double density = is_mirror ? kMirror
                                       : out_of_film(out.z, w.z) *
                                             Microsurface{roughness}.FirstBounce(first_from, w * first_flip, first_ior);
      return {frame.OutOf(out), density};
    }
    w.z = -w.z;
    in_layer = false;
  }
}

}  // namespace crownfit
