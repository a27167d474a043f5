#pragma once
// One path from the camera, outside the object: boundaries and lamps. Flights inside the layers: walk_pool.h.
//
// A path serves all photographs of one camera at once. Inside the object they are the same; outside they differ by
// their lamps. Where the path meets an object that only some of them have, it branches.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "optics/shading_terms.h"
#include "path/boundary.h"
#include "path/light_field.h"
#include "path/path_context.h"
#include "path/random_walk.h"
#include "path/score_derivatives.h"
#include "path/uncollided_light.h"
#include "scene/light_samples.h"

namespace crownfit {

/// One path from the camera, without the flights inside the layers. Every boundary and every opaque surface samples the
/// lamps in two ways, by the direction that the path takes and by points on the lamps. The balance heuristic combines
/// them (Veach and Guibas 1995).
class CameraPath {
 public:
  CameraPath(const PathContext& context, WalkCounters& counters)
      : context_(context),
        counters_(counters),
        derivatives_(context.media, context.cut_derivatives, context.polarisers.size()),
        value_(context.polarisers.size()),
        by_channel_(context.uncollided ? static_cast<size_t>(context.media.channels()) : 0),
        by_rays_(value_.size() * by_channel_) {}

  /// Starts a new path; false when it ended outside, true when it is on a flight inside.
  bool Begin(const glm::dvec3& position, const glm::dvec3& direction, int hero, const RandomStream& random) {
    state.Begin(context_.media.size(), context_.media.has_textures());
    state.position = position;
    state.direction = direction;
    random_ = random;
    hero_ = hero;
    value_.assign(value_.size(), Spectrum());
    by_rays_.assign(by_rays_.size(), {});
    at_ = {};
    at_.serves = static_cast<PhotographSet>((uint64_t{1} << value_.size()) - 1);
    if (context_.wants_derivatives) derivatives_.Begin();
    return GoOnOutside() || Resume();
  }

  /// Call when the path ended: true when another branch of it is on a flight inside.
  bool Resume() {
    while (!branches_.empty()) {
      Branch& b = branches_.back();
      state = std::move(b.state);
      random_ = b.random;
      at_ = b.at;
      branches_.pop_back();
      if (GoOnOutside()) return true;
    }
    return false;
  }

  /// Handles a boundary met from inside; false when the branch ended outside.
  bool Meet(const Boundary& b) {
    const int behind = b.behind(state.medium);
    if (IsOpaqueCut(b)) {
      ScatterBackInside(b.normal, context_.cut_reflectance);
      ++at_.cut_returns;
    } else if (b.outside != kOutside) {
      state.direction = ScatterAtSmoothBoundary(state.direction, b.normal,
                                                context_.media[behind].ior / context_.media[state.medium].ior, random_);
      state.medium = b.towards(state.direction);
    } else if (context_.contact && context_.contact->Holds(b.position)) {
      ScatterBackInside(b.normal, context_.contact->reflectance);
    } else {
      CrossOuter(b);
    }
    return state.medium != kOutside || GoOnOutside();
  }

  /// What a collision here and now would be weighted with, per channel.
  Spectrum WeightOfCollision() const { return at_.carried * context_.media.Weight(state); }
  /// What do() returns after what the walk did in this medium and the state does not count yet.
  template <class Do>
  auto After(const Visit& uncounted, const Do& todo) {
    Visit& visit = state.visits[state.medium];
    const Visit before = visit;
    visit.length_mm += uncounted.length_mm;
    visit.collisions += uncounted.collisions;
    visit.phase_score += uncounted.phase_score;
    const auto result = todo();
    visit = before;
    return result;
  }
  /// Adds the lamps' light at a collision that the walk reaches along `direction`; `uncounted`: what the state does not
  /// count yet.
  void Collide(const UncollidedLight& light, const UncollidedLight::Here& here, const glm::dvec3& direction,
               const Visit& uncounted, const std::array<float, kMostChannels>& weights) {
    for (size_t s = 0; s < light.sources().size(); ++s) {
      if (light.IsDark(here, s)) continue;
      if (context_.wants_derivatives) light.Differentiate(here, s, direction, state.medium, weights.data(), scattered_);
      ForEach(at_.serves & light.sources()[s].photographs, [&](size_t p) {
        std::array<float, kMostChannels> passed;
        const double factor =
            at_.is_depolarised
                ? 1.0
                : context_.polarisers[p].OfScattered(static_cast<double>(state.collisions + uncounted.collisions));
        for (size_t c = 0; c < by_channel_; ++c) passed[c] = weights[c] * static_cast<float>(factor);
        light.AddScattered(here, s, direction, context_.media[state.medium], passed.data(), &by_rays_[p * by_channel_]);
        if (!context_.wants_derivatives) return;
        After(uncounted, [&] {
          derivatives_.Add(p, state, at_.cut_returns, factor * scattered_.value);
          return 0;
        });
        for (size_t l = 0; l < scattered_.by.size(); ++l) {
          const LayerDerivatives& by = scattered_.by[l];
          derivatives_.AddOfLight(p, l, {factor * by.scattering, factor * by.absorption, factor * by.asymmetry});
        }
      });
    }
  }

  /// Ends a walk inside after its last collision: adds the diffuse radiance there, which is unpolarised.
  void HandOver() {
    const LightFields& fields = *context_.hand_over.fields;
    const auto here = fields.At(state.position);
    if (!here) return;
    const Spectrum weight = at_.carried * context_.media.Weight(state);
    ForEach(at_.serves, [&](size_t p) {
      const Spectrum seen = weight * fields.Radiance(p, *here);
      value_[p] += seen;
      if (!context_.wants_derivatives) return;
      derivatives_.Add(p, state, at_.cut_returns, seen);
      for (size_t l = 0; l + 1 < context_.media.size(); ++l)
        derivatives_.AddOfLight(
            p, l, {weight * fields.ByScattering(p, l, *here), weight * fields.ByAbsorption(p, l, *here), Spectrum()});
    });
  }

  /// pi x radiance found so far, per channel.
  Spectrum value(size_t photograph) const {
    Spectrum found = value_[photograph];
    if (by_channel_ > 0)
      found += Spectrum::Of(static_cast<int>(by_channel_), [&](int c) {
        const UncollidedLight::OfGroups& sums = by_rays(photograph)[static_cast<size_t>(c)];
        return std::accumulate(sums.begin(), sums.end(), 0.0);
      });
    return std::numbers::pi * found;
  }
  /// Part of it that the light's groups of rays found, per channel, without the pi; none without uncollided light.
  std::span<const UncollidedLight::OfGroups> by_rays(size_t photograph) const {
    return {by_rays_.data() + photograph * by_channel_, by_channel_};
  }
  /// Their derivatives, without the pi.
  const PathDerivatives& derivatives() const { return derivatives_; }
  /// Call where flights inside begin and end: each interval is one segment of the derivatives' control variates.
  void OpenStretch() { derivatives_.OpenStretch(state, at_.carried * context_.media.Left(state)); }
  void CloseStretch() {
    const auto controls = derivatives_.CloseStretch(state);
    if (controls) ForEach(at_.serves, [&](size_t p) { derivatives_.AddControls(p, state.medium, *controls); });
  }
  int hero() const { return hero_; }

  WalkState state;
  RandomStream& random() { return random_; }

 private:
  /// A branch of the path, besides its WalkState.
  struct Way {
    PhotographSet serves = 0;
    Spectrum carried = Spectrum(1.0);
    bool only_reflected = true, is_depolarised = false;
    bool sees_lamps = false;  // camera rays do not
    double density = kMirror;
    std::optional<Boundary> left{};  ///< the opaque boundary it leaves, if it leaves one
    int opaque_bounces = 0, cut_returns = 0;
    int collisions_before = 0;  ///< collisions before the last Lambertian bounce
  };
  struct Branch {
    WalkState state;
    RandomStream random;
    Way at;
  };

  /// Follows flights outside until one enters the object (true) or the branch ends.
  bool GoOnOutside() {
    for (;; at_.sees_lamps = true) {
      const auto boundary = NextOutside(state.direction, kFar, at_.serves);
      if (boundary && boundary->opaque >= 0) BranchOff(at_.serves & ~context_.opaque[boundary->opaque].photographs);
      if (at_.sees_lamps) AddLampsMet(boundary ? boundary->distance_mm : kFar);
      if (!boundary) return false;
      state.position = boundary->position;
      at_.left.reset();
      if (boundary->opaque >= 0) {
        if (!ScatterAtOpaque(*boundary)) return false;
        continue;
      }
      if (IsOpaqueCut(*boundary)) return false;  // gum and bone emit nothing
      CrossOuter(*boundary);
      if (state.medium == kOutside) continue;
      ++counters_.walks;
      at_.only_reflected = false;
      at_.sees_lamps = true;
      return true;
    }
  }

  /// Next boundary outside that exists in at least one photograph of `set`.
  std::optional<Boundary> NextOutside(const glm::dvec3& direction, double max_mm, PhotographSet set) const {
    return context_.scene.Next(state.position, direction, kOutside, max_mm, at_.left ? &*at_.left : nullptr,
                               [&](int opaque) { return (context_.opaque[opaque].photographs & set) != 0; });
  }

  /// `others` continue from here later, as a branch of their own. Branches may share random numbers, but no photograph.
  void BranchOff(PhotographSet others) {
    if (others == 0) return;
    branches_.push_back({state, random_, at_});
    branches_.back().at.serves = others;
    at_.serves &= ~others;
  }

  void Add(PhotographSet set, const Spectrum& radiance) {
    const Spectrum found = at_.carried * context_.media.Weight(state) * radiance;
    ForEach(set, [&](size_t p) {
      const Spectrum seen = FactorOf(context_.polarisers[p]) * found;
      value_[p] += seen;
      if (context_.wants_derivatives) derivatives_.Add(p, state, at_.cut_returns, seen);
    });
  }

  /// Whether the walk looks for the lamp itself. Followed lamps' light is found at collisions instead, unless there has
  /// been none since the camera or the last Lambertian bounce.
  bool Looks(const Lamp& lamp) const { return !lamp.is_followed || state.collisions == at_.collisions_before; }

  double FactorOf(const Polarisers& polarisers) const {
    return at_.only_reflected   ? polarisers.of_kept
           : at_.is_depolarised ? 1.0
                                : polarisers.OfScattered(static_cast<double>(state.collisions));
  }

  void AddLampsMet(double reach_mm) {
    for (const Lamp& lamp : context_.lamps) {
      const PhotographSet lit = at_.serves & lamp.photographs;
      if (lit == 0 || !Looks(lamp)) continue;
      const auto met = LightAlong(lamp.shape, state.position, state.direction);
      if (!met || reach_mm < met->distance_mm) continue;
      const double share = lamp.is_sampled && at_.density != kMirror ? at_.density / (at_.density + met->density) : 1.0;
      if (share > 0) Add(lit, share * lamp.scale * met->radiance);
    }
  }

  struct LampTarget {
    LightPoint point;
    const Lamp* lamp;
  };
  /// Sets `targets_`: a point on every sampled lamp above the plane of `normal`.
  void ChooseTargets(const glm::dvec3& normal) {
    targets_.clear();
    towards_.clear();
    for (const Lamp& lamp : context_.lamps) {
      if (!lamp.is_sampled || targets_.size() == kMaxLamps || (lamp.photographs & at_.serves) == 0 || !Looks(lamp))
        continue;
      const glm::dvec2 uniform(random_.Next(), random_.Next());
      const auto point = SampleLightPoint(lamp.shape, state.position, uniform);
      if (!point || glm::dot(point->direction, normal) <= 0) continue;
      targets_.push_back({*point, &lamp});
      towards_.push_back(point->direction);
    }
  }
  void AddTarget(const LampTarget& target, double estimate, double approximate) {
    const LightPoint& p = target.point;
    if (!(estimate > 0)) return;
    PhotographSet lit = at_.serves & target.lamp->photographs;
    while (lit != 0) {
      const auto before = NextOutside(p.direction, p.distance_mm, lit);
      if (!before) break;
      lit &= before->opaque >= 0 ? ~context_.opaque[before->opaque].photographs : 0;
    }
    if (lit != 0) Add(lit, estimate / (p.density + approximate) * target.lamp->scale * p.radiance);
  }

  void CrossOuter(const Boundary& b) {
    targets_.clear();
    towards_.clear();
    const OuterBoundary& outer = context_.outer[b.inside];
    if (!outer.is_smooth()) ChooseTargets(b.normal);
    densities_.assign(targets_.size(), {});
    const Scattered s = outer.Scatter(state.direction, b.normal, random_, towards_, densities_);
    for (size_t k = 0; k < targets_.size(); ++k)
      AddTarget(targets_[k], densities_[k].estimate, densities_[k].approximate);
    state.direction = s.direction;
    state.medium = b.towards(s.direction);
    at_.density = s.density;
  }

  bool IsOpaqueCut(const Boundary& b) const { return b.is_cut && context_.cut_is_opaque; }

  /// Lambertian reflection of light inside, back inside. The largest reflectance enters `boost`, which the roulette
  /// sees.
  void ScatterBackInside(const glm::dvec3& normal, const Spectrum& rho) {
    const double largest = rho.Largest();
    state.boost *= largest;
    if (largest > 0) at_.carried *= rho / largest;
    at_.is_depolarised = true;
    at_.collisions_before = state.collisions;
    state.direction = SampleLambert(-normal, random_);
  }

  bool ScatterAtOpaque(const Boundary& boundary) {
    constexpr double kRouletteBelow = 0.2;
    constexpr int kRouletteAfter = 64;  // bounces; white surfaces may form a cavity
    at_.left = boundary;
    at_.only_reflected = false;
    at_.is_depolarised = true;
    at_.collisions_before = state.collisions;
    at_.carried *= context_.opaque[boundary.opaque].reflectance;
    const double largest = at_.carried.Largest();
    if (!(largest > 0)) return false;
    const glm::dvec3 normal = glm::dot(boundary.normal, state.direction) < 0 ? boundary.normal : -boundary.normal;
    ChooseTargets(normal);
    for (const LampTarget& target : targets_) {
      const double density = glm::dot(target.point.direction, normal) / std::numbers::pi;
      AddTarget(target, density, density);
    }
    const double survival =
        std::min(1.0, largest / kRouletteBelow) * (++at_.opaque_bounces > kRouletteAfter ? 0.5 : 1.0);
    if (survival < 1.0) {
      if (random_.Next() >= survival) return false;
      at_.carried /= survival;
    }
    state.direction = SampleLambert(normal, random_);
    at_.density = std::max(0.0, glm::dot(state.direction, normal)) / std::numbers::pi;
    return true;
  }

  const PathContext& context_;
  WalkCounters& counters_;
  PathDerivatives derivatives_;
  RandomStream random_{0};
  int hero_ = 0;
  std::vector<Spectrum> value_;                     ///< per photograph
  size_t by_channel_;                               ///< channels of uncollided light; 0: there is none
  std::vector<UncollidedLight::OfGroups> by_rays_;  ///< per photograph and channel
  UncollidedLight::Scattered scattered_;            ///< work space
  Way at_;
  std::vector<Branch> branches_;  ///< not yet followed
  std::vector<LampTarget> targets_;
  std::vector<glm::dvec3> towards_;  ///< their directions
  std::vector<TargetDensity> densities_;
};

}  // namespace crownfit
