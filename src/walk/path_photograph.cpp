#include "walk/path_photograph.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "base/parallel.h"
#include "geometry/light_samples.h"
#include "walk/boundary.h"

namespace crownfit {
namespace {

constexpr size_t kMaxLamps = 32;  // sampled at one place; more are found by chance alone

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
};

/// One path from the camera. Every boundary and every opaque surface looks for the lamps in two ways, by the direction
/// that the path takes and by points on the lamps, combined by the balance heuristic (Veach and Guibas 1995).
class Path {
 public:
  Path(const Studio& studio, RandomStream& random, WalkCounters& counters)
      : studio_(studio), random_(random), counters_(counters) {}

  /// pi x radiance, per channel, that arrives at `position` from `direction`.
  glm::dvec3 Trace(const glm::dvec3& position, const glm::dvec3& direction, int hero) {
    state_.Begin(studio_.media.size());
    state_.position = position;
    state_.direction = direction;
    value_ = glm::dvec3(0.0);
    carried_ = glm::dvec3(1.0);
    only_reflected_ = true;
    left_ = nullptr;
    opaque_bounces_ = 0;
    bool sees_lamps = false;  // the camera does not
    while (Advance(sees_lamps, hero)) sees_lamps = true;
    return std::numbers::pi * value_;
  }

 private:
  /// One flight through the open, what it meets, and the walk inside if it enters. False at the path's end.
  bool Advance(bool sees_lamps, int hero) {
    const auto boundary = studio_.scene.Next(state_.position, state_.direction, kOutside, kFar, left_);
    if (sees_lamps) AddLampsMet(boundary ? boundary->distance_mm : kFar);
    if (!boundary) return false;
    state_.position = boundary->position;
    left_ = nullptr;
    if (boundary->opaque >= 0) return ScatterAtOpaque(*boundary);
    if (IsOpaqueCut(*boundary)) return false;  // gum and bone: nothing comes from there
    CrossOuter(*boundary);
    if (state_.medium == kOutside) return true;
    ++counters_.walks;
    only_reflected_ = false;
    return Walk(
        studio_.scene, studio_.media, hero, state_, random_, counters_,
        [&](const Boundary& b) {
          const int behind = b.behind(state_.medium);
          if (IsOpaqueCut(b)) return ScatterBackInside(b.normal, studio_.cut_reflectance);
          if (b.outside == kOutside) {
            const bool in_contact = studio_.contact && studio_.contact->Holds(b.position);
            return in_contact ? ScatterBackInside(b.normal, studio_.contact->reflectance) : CrossOuter(b);
          }
          state_.direction = ScatterAtSmoothBoundary(
              state_.direction, b.normal, studio_.media[behind].ior / studio_.media[state_.medium].ior, random_);
          state_.medium = b.towards(state_.direction);
        },
        [](int medium) { return medium == kOutside; });
  }

  void Add(const glm::dvec3& radiance) {
    value_ += (only_reflected_ ? studio_.specular_factor : 1.0) * carried_ * studio_.media.Weight(state_) * radiance;
  }

  void AddLampsMet(double reach_mm) {
    for (const Lamp& lamp : studio_.lamps) {
      const auto met = LightAlong(lamp.shape, state_.position, state_.direction);
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
      const auto point = SampleLightPoint(lamp.shape, state_.position, uniform);
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
    if (studio_.scene.Next(state_.position, p.direction, kOutside, p.distance_mm, left_)) return;
    Add(estimate / (p.density + approximate) * t.scale[k] * p.radiance);
  }

  void CrossOuter(const Boundary& b) {
    LampTargets targets;
    const OuterBoundary& outer = studio_.outer[b.inside];
    if (!outer.is_smooth()) targets = ChooseTargets(b.normal);
    std::array<TargetDensity, kMaxLamps> densities;
    const Scattered s = outer.Scatter(state_.direction, b.normal, random_, {targets.direction.data(), targets.count},
                                      {densities.data(), targets.count});
    for (size_t k = 0; k < targets.count; ++k) AddTarget(targets, k, densities[k].estimate, densities[k].approximate);
    state_.direction = s.direction;
    state_.medium = b.towards(s.direction);
    density_ = s.density;
  }

  bool IsOpaqueCut(const Boundary& b) const { return b.is_cut && studio_.cut_is_opaque; }

  /// From inside, back inside, off a Lambertian surface. The roulette sees how little a dark one returns.
  void ScatterBackInside(const glm::dvec3& normal, const glm::dvec3& rho) {
    const double largest = std::max({rho.x, rho.y, rho.z});
    state_.boost *= largest;
    if (largest > 0) carried_ *= rho / largest;
    state_.direction = SampleLambert(-normal, random_);
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
    const glm::dvec3 normal = glm::dot(boundary.normal, state_.direction) < 0 ? boundary.normal : -boundary.normal;
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
    state_.direction = SampleLambert(normal, random_);
    density_ = std::max(0.0, glm::dot(state_.direction, normal)) / std::numbers::pi;
    return true;
  }

  const Studio& studio_;
  RandomStream& random_;
  WalkCounters& counters_;
  WalkState state_;
  glm::dvec3 value_{0.0}, carried_{1.0};
  bool only_reflected_ = true;
  double density_ = kMirror;
  Boundary left_is_{};              ///< the opaque boundary the path leaves ...
  const Boundary* left_ = nullptr;  ///< ... if it leaves one
  int opaque_bounces_ = 0;
};

/// Sums of independent samples.
struct PixelSum {
  glm::dvec3 sum{0.0};
  std::array<double, 6> square{};
  void Add(const glm::dvec3& x) {
    sum += x;
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) square[k++] += x[a] * x[b];
  }
  PixelEstimate Estimate(int samples) const {
    PixelEstimate e;
    const double n = samples;
    e.mean = sum / n;
    int k = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b, ++k)
        e.covariance[k] = samples > 1 ? (square[k] / n - e.mean[a] * e.mean[b]) / (n - 1.0) : 0.0;
    return e;
  }
};

}  // namespace

glm::dvec3 HalfSpaceReflectance(const Material::Layer& layer) {
  glm::dvec3 reflectance(0.0);
  for (int c = 0; c < kChannels; ++c) {
    const double scattering = layer[Quantity::kReducedScattering][c], absorption = layer[Quantity::kAbsorption][c];
    if (!(scattering > 0)) continue;
    const double s = std::sqrt(absorption / (absorption + scattering));
    reflectance[c] = (1.0 - s) * (1.0 - 0.139 * s) / (1.0 + 1.17 * s);
  }
  return reflectance;
}

Media MediaOf(const Capture& capture, const Material& material, const LayeredBody& body) {
  std::vector<Medium> media(1);
  media[0].ior = capture.outside_ior;
  for (size_t l = 0; l < material.layers.size(); ++l) {
    const Material::Layer& layer = material.layers[l];
    Medium m;
    m.texture = body.absorption[l].get();
    m.ior = layer[Quantity::kIor][0];
    m.g = layer[Quantity::kAsymmetry][0];
    m.isotropic_fraction = layer[Quantity::kIsotropicFraction][0];
    const double reduction = 1.0 - (1.0 - m.isotropic_fraction) * m.g;
    for (int c = 0; c < kChannels; ++c) {
      m.scattering[c] = layer[Quantity::kReducedScattering][c] / reduction;
      m.absorption[c] = layer[Quantity::kAbsorption][c];
    }
    media.push_back(m);
  }
  return Media(std::move(media));
}

PathPhotograph RenderByPaths(const Capture& capture, const LayeredBody& body, const std::vector<TriangleMesh>& scenery,
                             const Material& material, size_t photograph, const PathOptions& options,
                             const std::function<void(double)>& progress) {
  const PhotographSpec& photo = capture.photographs[photograph];
  std::vector<TriangleMesh> opaque;
  std::vector<glm::dvec3> reflectance;
  for (size_t i : photo.scenery) {
    opaque.push_back(scenery[i]);
    reflectance.push_back(capture.scenery[i].reflectance);
  }
  if (photo.backing) {
    const BackingSpec& tile = capture.backings[*photo.backing];
    opaque.push_back(SquareTile(tile.point_mm, tile.normal, tile.size_mm));
    reflectance.push_back(tile.reflectance);
  }
  const RigidTransform object_from_camera = photo.camera_from_object.Inverse();
  const WalkScene scene(body, opaque);
  const Media media = MediaOf(capture, material, body);
  Studio studio{scene, media, reflectance};
  studio.specular_factor = SpecularFactor(photo.polarisation);
  for (size_t i = 0; i < media.size(); ++i)
    studio.outer.push_back({material.surface[Quantity::kRoughness][0], material.surface[Quantity::kWetness][0],
                            media[static_cast<int>(i)].ior, capture.outside_ior});
  studio.cut_is_opaque = capture.neck != Neck::kAir;
  if (capture.neck == Neck::kRoot)
    studio.cut_reflectance =
        glm::min(material.surface[Quantity::kNeckReturn][0] * HalfSpaceReflectance(material.layers.back()), 1.0);
  if (photo.backing && capture.backings[*photo.backing].in_contact)
    studio.contact.emplace(capture.backings[*photo.backing]);
  for (size_t i : photo.lights) {
    const Light& light = capture.lights[i];
    studio.lamps.push_back({light.in_camera_frame ? Transformed(light.shape, object_from_camera) : light.shape,
                            light.intensity_scale, !std::holds_alternative<DomeLight>(light.shape)});
  }

  PathPhotograph result;
  result.width = photo.camera.width;
  result.height = photo.camera.height;
  result.pixels.resize(static_cast<size_t>(result.width) * result.height);
  const int heroes = media.heroes(), samples = std::max(1, (options.paths_per_pixel + heroes - 1) / heroes);
  std::vector<WalkCounters> counters(result.pixels.size());
  const auto render = [&](size_t pixel) {
    const size_t column = pixel % result.width, row = pixel / result.width;
    PixelSum sum;
    for (int s = 0; s < samples; ++s) {
      glm::dvec3 value(0.0);
      for (int hero = 0; hero < heroes; ++hero) {
        RandomStream random(Key(options.seed, 0x70617468ull, options.stream, photograph, pixel, s, hero));
        const double x = static_cast<double>(column) + random.Next(), y = static_cast<double>(row) + random.Next();
        const glm::dvec3 direction = object_from_camera.Direction(DirectionFromPixel(photo.camera, {x, y}));
        value += Path(studio, random, counters[pixel]).Trace(object_from_camera.translation_mm, direction, hero);
      }
      sum.Add(value / static_cast<double>(heroes));
    }
    result.pixels[pixel] = sum.Estimate(samples);
    const glm::dvec2 centre(static_cast<double>(column) + 0.5, static_cast<double>(row) + 0.5);
    const auto seen =
        scene.Next(object_from_camera.translation_mm,
                   object_from_camera.Direction(DirectionFromPixel(photo.camera, centre)), kOutside, kFar);
    result.pixels[pixel].on_object = seen && seen->opaque < 0;
  };
  constexpr size_t kAtOnce = 256;
  for (size_t begin = 0; begin < result.pixels.size(); begin += kAtOnce) {
    const size_t count = std::min(kAtOnce, result.pixels.size() - begin);
    ParallelFor(count, options.threads, [&](size_t i) { render(begin + i); });
    progress(static_cast<double>(begin + count) / static_cast<double>(result.pixels.size()));
  }
  for (const auto& c : counters) result.counters.Add(c);
  return result;
}

}  // namespace crownfit
