#include "path/light_rays.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "scene/light_samples.h"

namespace crownfit {
namespace {

constexpr int kMostEvents = 200;  // per ray; plane faces of a clear layer trap light by total reflection

class LightTracer {
 public:
  LightTracer(const PathContext& context, const VolumeLattice& lattice, size_t photograph, const Lighting& lighting,
              double area_mm2)
      : context_(context),
        lattice_(lattice),
        self_(PhotographSet{1} << photograph),
        lighting_(lighting),
        area_mm2_(area_mm2) {
    for (const Lamp& lamp : context.lamps)
      if (lamp.photographs & self_) (lamp.is_sampled ? sampled_ : around_).push_back(&lamp);
    has_things_ = std::any_of(context.opaque.begin(), context.opaque.end(),
                              [&](const OpaqueThing& t) { return (t.photographs & self_) != 0; });
  }

  void Trace(int number, int hero, uint64_t key) {
    const BoundaryPiece& piece = lattice_.pieces()[number];
    if (IsClosed(piece)) return;
    hero_ = hero;
    for (size_t k = 0; k < sampled_.size(); ++k) {  // one stream per lamp: a ray's use of random numbers varies
      random_ = RandomStream(Key(key, k));
      FromLamp(*sampled_[k], piece);
    }
    random_ = RandomStream(key);
    if (!around_.empty() || has_things_) FromAround(piece);
  }

  /// Follows diffuse light that leaves a piece with power 1. The ray also represents surrounding area without a ray.
  void TraceBack(int number, int hero, uint64_t key) {
    const BoundaryPiece& piece = lattice_.pieces()[number];
    if (IsClosed(piece)) return;
    hero_ = hero;
    random_ = RandomStream(key);
    Follow(piece.position, SampleLambert(piece.normal, random_), kOutside,
           Spectrum(context_.media.channels(), area_mm2_ / piece.area_mm2), number);
  }

  LightRays found;

 private:
  std::optional<Boundary> Outside(const glm::dvec3& from, const glm::dvec3& direction, double max_mm,
                                  const Boundary* left) const {
    return context_.scene.Next(from, direction, kOutside, max_mm, left,
                               [&](int opaque) { return (context_.opaque[opaque].photographs & self_) != 0; });
  }

  void FromLamp(const Lamp& lamp, const BoundaryPiece& piece) {
    const Spectrum irradiance = Irradiance(lamp, piece.position, piece.normal, nullptr);
    if (!(irradiance.Largest() > 0)) return;
    Enter(piece, -to_lamp_, area_mm2_ * irradiance);
  }

  /// Irradiance from one lamp by a random point on it; sets `to_lamp_`, the direction to that point.
  Spectrum Irradiance(const Lamp& lamp, const glm::dvec3& at, const glm::dvec3& normal, const Boundary* left) {
    const glm::dvec2 uniform(random_.Next(), random_.Next());
    const auto point = SampleLightPoint(lamp.shape, at, uniform);
    if (!point) return Spectrum();
    const double cosine = glm::dot(point->direction, normal);
    if (cosine <= 0 || Outside(at, point->direction, point->distance_mm, left)) return Spectrum();
    to_lamp_ = point->direction;
    return lamp.scale * cosine / point->density * point->radiance;
  }

  /// Light from a random direction: from lamps all around, and reflected by opaque objects.
  void FromAround(const BoundaryPiece& piece) {
    const glm::dvec3 direction = SampleLambert(piece.normal, random_);
    Spectrum radiance(context_.media.channels(), 0.0), carried(1.0);
    glm::dvec3 from = piece.position, way = direction;
    std::optional<Boundary> left;
    constexpr int kMostBounces = 4;
    for (int bounce = 0;; ++bounce) {
      const auto met = Outside(from, way, kFar, left ? &*left : nullptr);
      for (const Lamp* lamp : around_)
        if (const auto light = LightAlong(lamp->shape, from, way);
            light && !(met && met->distance_mm < light->distance_mm))
          radiance += carried * lamp->scale * light->radiance;
      if (!met || met->opaque < 0 || bounce == kMostBounces) break;
      carried *= context_.opaque[met->opaque].reflectance;
      if (!(carried.Largest() > 0)) break;
      const glm::dvec3 normal = glm::dot(met->normal, way) < 0 ? met->normal : -met->normal;
      from = met->position;
      left = met;
      for (const Lamp* lamp : sampled_)
        radiance += carried * Irradiance(*lamp, from, normal, &*left) / std::numbers::pi;
      way = SampleLambert(normal, random_);
    }
    if (radiance.Largest() > 0) Enter(piece, -direction, area_mm2_ * std::numbers::pi * radiance);
  }

  void Enter(const BoundaryPiece& piece, const glm::dvec3& direction, const Spectrum& power) {
    const int inside = piece.layer + 1;
    const Scattered s = context_.outer[inside].Scatter(direction, piece.normal, random_, {}, {});
    Follow(piece.position, s.direction, glm::dot(s.direction, piece.normal) < 0 ? inside : kOutside, power, -1);
  }

  /// No light enters or leaves here.
  bool IsClosed(const BoundaryPiece& piece) const {
    return (piece.is_cut && context_.cut_is_opaque) || (context_.contact && context_.contact->Holds(piece.position));
  }

  /// Adds the ray's steps inside the object.
  void Follow(glm::dvec3 position, glm::dvec3 direction, int medium, Spectrum carried, int piece) {
    const size_t first = found.steps.size();
    std::optional<Boundary> left;
    const double least = lighting_.least * carried.Largest();
    int to_go = lighting_.collisions;
    double depth = 0;  // optical depth of the clearest channel
    for (int event = 0; event < kMostEvents + lighting_.collisions && carried.Largest() * std::exp(-depth) > least;
         ++event) {
      const Medium& here = context_.media[medium];
      const double scattering = here.scattering[hero_];
      const double flight =
          medium != kOutside && to_go > 0 && scattering > 0 ? -std::log(1.0 - random_.Next()) / scattering : kFar;
      const auto b = medium == kOutside ? Outside(position, direction, kFar, left ? &*left : nullptr)
                                        : context_.scene.Next(position, direction, medium, flight);
      if (!b && std::isinf(flight)) break;
      left.reset();
      if (medium != kOutside) {
        const double length = b ? b->distance_mm : flight;
        AddSteps(position, direction, length, medium, to_go == 0, !b, carried);
        const Spectrum lost = to_go == 0 ? here.absorption + here.similarity() * here.scattering : here.absorption;
        depth += length * lost.Smallest();
      }
      if (!b) {
        position += flight * direction;
        direction = SamplePhaseFunction(here, direction, random_);
        --to_go;
        continue;
      }
      position = b->position;
      if (medium == kOutside) {
        if (b->opaque >= 0) {
          carried *= context_.opaque[b->opaque].reflectance;
          direction = SampleLambert(glm::dot(b->normal, direction) < 0 ? b->normal : -b->normal, random_);
          left = b;
        } else if (b->is_cut && context_.cut_is_opaque) {
          break;
        } else {
          Cross(*b, direction, medium);
        }
      } else if (b->is_cut && context_.cut_is_opaque) {
        carried *= context_.cut_reflectance;
        direction = SampleLambert(-b->normal, random_);
      } else if (b->outside != kOutside) {
        const double relative_ior = context_.media[b->behind(medium)].ior / here.ior;
        direction = ScatterAtSmoothBoundary(direction, b->normal, relative_ior, random_);
        medium = b->towards(direction);
      } else if (context_.contact && context_.contact->Holds(b->position)) {
        carried *= context_.contact->reflectance;
        direction = SampleLambert(-b->normal, random_);
      } else {
        Cross(*b, direction, medium);
      }
    }
    if (found.steps.size() > first) found.rays.push_back({first, found.steps.size() - first, hero_, piece});
  }

  void Cross(const Boundary& b, glm::dvec3& direction, int& medium) {
    direction = context_.outer[b.inside].Scatter(direction, b.normal, random_, {}, {}).direction;
    medium = b.towards(direction);
  }

  void AddSteps(const glm::dvec3& from, const glm::dvec3& direction, double length_mm, int medium, bool is_reduced,
                bool collides, const Spectrum& carried) {
    const int parts = std::max(1, static_cast<int>(std::ceil(length_mm / lattice_.element_mm())));
    const double step = length_mm / parts;
    const auto power = static_cast<uint32_t>(found.carried.size());
    found.carried.push_back(carried);
    for (int i = 0; i < parts; ++i)
      if (const auto place = lattice_.PlaceOf(from + (i + 0.5) * step * direction))
        found.steps.push_back({*place, static_cast<float>(step), static_cast<int16_t>(medium), is_reduced,
                               collides && i + 1 == parts, power});
  }

  const PathContext& context_;
  const VolumeLattice& lattice_;
  PhotographSet self_;
  Lighting lighting_;
  double area_mm2_;  ///< surface area that one ray represents
  int hero_ = 0;
  std::vector<const Lamp*> sampled_, around_;
  bool has_things_;
  RandomStream random_{0};
  glm::dvec3 to_lamp_{0.0};
};

}  // namespace

LightRays TraceLight(const PathContext& context, const VolumeLattice& lattice, size_t photograph,
                     const Lighting& lighting, uint64_t seed, size_t part, size_t parts,
                     const std::function<void(const LightRays&)>& take) {
  constexpr size_t kAtOnce = 20000;  // steps per batch: they stay in the cache until they are taken
  const std::vector<BoundaryPiece>& pieces = lattice.pieces();
  const int heroes = context.media.heroes();
  double area = 0;
  for (const BoundaryPiece& piece : pieces) area += piece.area_mm2;
  const double step = area / lighting.rays;
  LightTracer of_lamps(context, lattice, photograph, lighting, step), back = of_lamps;
  double passed = 0;
  int ray = 0;
  for (size_t i = 0; i < pieces.size(); ++i) {
    passed += pieces[i].area_mm2;
    for (; (ray + 0.5) * step < passed; ++ray) {
      if (ray % static_cast<int>(parts) != static_cast<int>(part)) continue;
      of_lamps.Trace(static_cast<int>(i), ray % heroes, Key(seed, 0x6c69676874ull, ray));
      back.TraceBack(static_cast<int>(i), ray % heroes, Key(seed, 0x6261636bull, ray));
      if (of_lamps.found.steps.size() < kAtOnce) continue;
      take(of_lamps.found);
      of_lamps.found.Clear();
    }
  }
  take(of_lamps.found);
  return std::move(back.found);
}

}  // namespace crownfit
