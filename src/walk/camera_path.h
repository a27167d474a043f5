#pragma once
// One path from the camera through the open, its boundaries and its lamps. Flights inside the layers: walk_pool.h.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>
#include <vector>

#include "calibration/capture.h"
#include "geometry/light_samples.h"
#include "optics/shading_terms.h"
#include "walk/boundary.h"
#include "walk/path_slopes.h"
#include "walk/random_walk.h"

namespace crownfit {

inline constexpr size_t kMaxLamps = 32;  // sampled at one place; more are found by chance alone

struct Lamp {
  LightShape shape;
  double scale;
  bool is_sampled;  ///< a dome is so large that directions find it by themselves
};

/// A tile in optical contact: where the outer surface lies on it (within kContactMm), light inside meets the tile's
/// Lambertian surface in place of the boundary.
struct ContactTile {
  static constexpr double kContactMm = 0.05;
  glm::dvec3 centre, normal, side_u, side_v;
  double half_size_mm;
  glm::dvec3 reflectance;

  ContactTile(const BackingSpec& b)
      : centre(b.point_mm), normal(b.normal), half_size_mm(0.5 * b.size_mm), reflectance(b.reflectance) {
    std::tie(side_u, side_v) = Tangents(normal);
  }
  bool Holds(const glm::dvec3& p) const {
    const glm::dvec3 d = p - centre;
    return std::abs(glm::dot(d, normal)) <= kContactMm && std::abs(glm::dot(d, side_u)) <= half_size_mm &&
           std::abs(glm::dot(d, side_v)) <= half_size_mm;
  }
};

/// Everything that stays the same for all paths of one photograph.
struct Studio {
  const WalkScene& scene;
  const Media& media;
  const std::vector<glm::dvec3>& reflectance;  ///< of opaque things
  std::vector<OuterBoundary> outer{};          ///< between each medium and the outside
  bool cut_is_opaque = false;
  glm::dvec3 cut_reflectance{0.0};  ///< of an opaque cut, from inside
  std::optional<ContactTile> contact{};
  std::vector<Lamp> lamps{};
  double specular_factor = 1.0;  ///< of light that the outer surface alone reflected
  bool wants_slopes = false;     ///< derivatives beside the values
  CutSlopes cut_slopes{};
  /// For light that leaves smoothly: lamps are looked for in the lobe of diffuse light that is refracted out, in place
  /// of the one direction it takes. Per medium the lobe's 1 / (pi x share of diffuse light that enters from outside).
  bool has_diffuse_exits = false;
  std::vector<double> exit_scale{};
};

/// One path from the camera, up to where flights inside the layers take over and from where they end. Every boundary
/// and every opaque surface looks for the lamps in two ways, by the direction that the path takes and by points on the
/// lamps, combined by the balance heuristic (Veach and Guibas 1995).
class CameraPath {
 public:
  CameraPath(const Studio& studio, WalkCounters& counters)
      : studio_(studio), counters_(counters), slopes_(studio.media, studio.cut_slopes) {}

  /// Starts anew; false when the path ended outside, true when it is on a flight inside.
  bool Begin(const glm::dvec3& position, const glm::dvec3& direction, int hero, const RandomStream& random) {
    state.Begin(studio_.media.size());
    state.position = position;
    state.direction = direction;
    random_ = random;
    hero_ = hero;
    value_ = glm::dvec3(0.0);
    carried_ = glm::dvec3(1.0);
    only_reflected_ = true;
    left_ = nullptr;
    opaque_bounces_ = 0;
    sees_lamps_ = false;  // the camera does not
    if (studio_.wants_slopes) slopes_.Begin();
    return GoOnOutside();
  }

  /// Inside, at a boundary; false when the path ended outside.
  bool Meet(const Boundary& b) {
    const int behind = b.behind(state.medium);
    if (IsOpaqueCut(b)) {
      ScatterBackInside(b.normal, studio_.cut_reflectance);
      slopes_.ReturnedByTheCut();
    } else if (b.outside != kOutside) {
      state.direction = ScatterAtSmoothBoundary(state.direction, b.normal,
                                                studio_.media[behind].ior / studio_.media[state.medium].ior, random_);
      state.medium = b.towards(state.direction);
    } else if (studio_.contact && studio_.contact->Holds(b.position)) {
      ScatterBackInside(b.normal, studio_.contact->reflectance);
    } else {
      CrossOuter(b);
    }
    return state.medium != kOutside || GoOnOutside();
  }

  /// pi x radiance found so far, per channel.
  glm::dvec3 value() const { return std::numbers::pi * value_; }
  /// Their derivatives, without the pi.
  const PathSlopes& slopes() const { return slopes_; }
  /// To be called where flights inside begin and end: what lies between is one stretch of the derivatives' controls.
  void OpenStretch() { slopes_.OpenStretch(state, carried_ * studio_.media.Left(state)); }
  void CloseStretch() { slopes_.CloseStretch(state); }
  int hero() const { return hero_; }

  WalkState state;
  RandomStream& random() { return random_; }

 private:
  /// Flights through the open and what they meet, until one enters the object (true) or the path ends.
  bool GoOnOutside() {
    for (;; sees_lamps_ = true) {
      const auto boundary = studio_.scene.Next(state.position, state.direction, kOutside, kFar, left_);
      if (sees_lamps_) AddLampsMet(boundary ? boundary->distance_mm : kFar);
      if (!boundary) return false;
      state.position = boundary->position;
      left_ = nullptr;
      if (boundary->opaque >= 0) {
        if (!ScatterAtOpaque(*boundary)) return false;
        continue;
      }
      if (IsOpaqueCut(*boundary)) return false;  // gum and bone: nothing comes from there
      CrossOuter(*boundary);
      if (state.medium == kOutside) continue;
      ++counters_.walks;
      only_reflected_ = false;
      sees_lamps_ = true;
      return true;
    }
  }

  void Add(const glm::dvec3& radiance) {
    const glm::dvec3 found =
        (only_reflected_ ? studio_.specular_factor : 1.0) * carried_ * studio_.media.Weight(state) * radiance;
    value_ += found;
    if (studio_.wants_slopes) slopes_.Add(state, found);
  }

  void AddLampsMet(double reach_mm) {
    for (const Lamp& lamp : studio_.lamps) {
      const auto met = LightAlong(lamp.shape, state.position, state.direction);
      if (!met || reach_mm < met->distance_mm) continue;
      const double share = lamp.is_sampled && density_ != kMirror ? density_ / (density_ + met->density) : 1.0;
      if (share > 0) Add(share * lamp.scale * met->radiance);
    }
  }

  struct LampTargets {
    std::array<LightPoint, kMaxLamps> point;
    std::array<glm::dvec3, kMaxLamps> direction;
    std::array<double, kMaxLamps> scale;
    size_t count = 0;
  };
  /// A point on every sampled lamp that stands above the plane of `normal`.
  LampTargets ChooseTargets(const glm::dvec3& normal) {
    LampTargets t;
    for (const Lamp& lamp : studio_.lamps) {
      if (!lamp.is_sampled || t.count == kMaxLamps) continue;
      const glm::dvec2 uniform(random_.Next(), random_.Next());
      const auto point = SampleLightPoint(lamp.shape, state.position, uniform);
      if (!point || glm::dot(point->direction, normal) <= 0) continue;
      t.point[t.count] = *point;
      t.direction[t.count] = point->direction;
      t.scale[t.count++] = lamp.scale;
    }
    return t;
  }
  void AddTarget(const LampTargets& t, size_t k, double estimate, double approximate) {
    const LightPoint& p = t.point[k];
    if (!(estimate > 0)) return;
    if (studio_.scene.Next(state.position, p.direction, kOutside, p.distance_mm, left_)) return;
    Add(estimate / (p.density + approximate) * t.scale[k] * p.radiance);
  }

  void CrossOuter(const Boundary& b) {
    LampTargets targets;
    const OuterBoundary& outer = studio_.outer[b.inside];
    if (!outer.is_smooth()) targets = ChooseTargets(b.normal);
    std::array<TargetDensity, kMaxLamps> densities;
    const Scattered s = outer.Scatter(state.direction, b.normal, random_, {targets.direction.data(), targets.count},
                                      {densities.data(), targets.count});
    for (size_t k = 0; k < targets.count; ++k) AddTarget(targets, k, densities[k].estimate, densities[k].approximate);
    const bool was_inside = state.medium != kOutside;
    state.direction = s.direction;
    state.medium = b.towards(s.direction);
    density_ = s.density;
    if (studio_.has_diffuse_exits && outer.is_smooth() && was_inside && state.medium == kOutside) ExitDiffusely(b);
  }

  /// Adds what lamps would give if light inside were diffuse; the way on finds them no more.
  void ExitDiffusely(const Boundary& b) {
    const double relative_ior = studio_.outer[b.inside].inside_ior / studio_.outer[b.inside].outside_ior;
    const LampTargets targets = ChooseTargets(b.normal);
    for (size_t k = 0; k < targets.count; ++k) {
      const double cosine = glm::dot(targets.direction[k], b.normal);
      const double passed = 1.0 - Terms<double>::FresnelReflectance(cosine, relative_ior);
      AddTarget(targets, k, studio_.exit_scale[b.inside] * passed * cosine, 0.0);
    }
    density_ = 0.0;
  }

  bool IsOpaqueCut(const Boundary& b) const { return b.is_cut && studio_.cut_is_opaque; }

  /// From inside, back inside, off a Lambertian surface. The roulette sees how little a dark one returns.
  void ScatterBackInside(const glm::dvec3& normal, const glm::dvec3& rho) {
    const double largest = std::max({rho.x, rho.y, rho.z});
    state.boost *= largest;
    if (largest > 0) carried_ *= rho / largest;
    state.direction = SampleLambert(-normal, random_);
  }

  bool ScatterAtOpaque(const Boundary& boundary) {
    constexpr double kRouletteBelow = 0.2;
    constexpr int kRouletteAfter = 64;  // bounces: white things may close a cavity
    left_is_ = boundary;
    left_ = &left_is_;
    only_reflected_ = false;
    carried_ *= studio_.reflectance[boundary.opaque];
    const double largest = std::max({carried_.x, carried_.y, carried_.z});
    if (!(largest > 0)) return false;
    const glm::dvec3 normal = glm::dot(boundary.normal, state.direction) < 0 ? boundary.normal : -boundary.normal;
    const LampTargets targets = ChooseTargets(normal);
    for (size_t k = 0; k < targets.count; ++k) {
      const double density = glm::dot(targets.direction[k], normal) / std::numbers::pi;
      AddTarget(targets, k, density, density);
    }
    const double survival = std::min(1.0, largest / kRouletteBelow) * (++opaque_bounces_ > kRouletteAfter ? 0.5 : 1.0);
    if (survival < 1.0) {
      if (random_.Next() >= survival) return false;
      carried_ /= survival;
    }
    state.direction = SampleLambert(normal, random_);
    density_ = std::max(0.0, glm::dot(state.direction, normal)) / std::numbers::pi;
    return true;
  }

  const Studio& studio_;
  WalkCounters& counters_;
  PathSlopes slopes_;
  RandomStream random_{0};
  int hero_ = 0;
  glm::dvec3 value_{0.0}, carried_{1.0};
  bool only_reflected_ = true, sees_lamps_ = false;
  double density_ = kMirror;
  Boundary left_is_{};              ///< the opaque boundary the path leaves ...
  const Boundary* left_ = nullptr;  ///< ... if it leaves one
  int opaque_bounces_ = 0;
};

}  // namespace crownfit
