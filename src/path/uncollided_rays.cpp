#include "path/uncollided_rays.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "scene/light_samples.h"

namespace crownfit {

/// A triangle that may bound the object.
struct UncollidedRays::Face {
  glm::dvec3 corner, side_u, side_v, normal;
  double area_mm2;
};

UncollidedRays::UncollidedRays(const PathContext& context, const Media& media, const LayeredBody& body)
    : context_(context), media_(media), body_(body) {
  FindSources();
  FindFaces();
  for (const Lamp& lamp : context.lamps)
    light_up_to_.push_back(lamp.is_followed ? LightUpTo(lamp) : std::vector<double>());
}
UncollidedRays::~UncollidedRays() = default;

void UncollidedRays::FindSources() {
  for (size_t l = 0; l < context_.lamps.size(); ++l) {
    if (!context_.lamps[l].is_followed) continue;
    // Photographs with the same opaque objects share the lamp's light.
    PhotographSet left = context_.lamps[l].photographs;
    while (left != 0) {
      const PhotographSet one = left & (~left + 1);
      PhotographSet alike = left;
      for (const OpaqueThing& thing : context_.opaque)
        alike &= thing.photographs & one ? thing.photographs : ~thing.photographs;
      const auto source =
          std::find_if(sources_.begin(), sources_.end(), [&](const Source& s) { return s.photographs == alike; });
      if (source == sources_.end())
        sources_.push_back({{l}, alike});
      else
        source->lamps.push_back(l);
      left &= ~alike;
    }
  }
}

/// In an order in which neighbours are close together: along a Morton curve through their middles.
void UncollidedRays::FindFaces() {
  std::vector<std::pair<uint64_t, Face>> found;
  for (size_t s = 0; s < body_.surfaces.size(); ++s)
    for (int t = 0; t < static_cast<int>(body_.surfaces[s].triangles.size()); ++t) {
      if (s > 0 && !body_.is_exposed[s][t]) continue;
      const TriangleMesh& mesh = body_.surfaces[s];
      const glm::ivec3& corner = mesh.triangles[t];
      const glm::dvec3 a = mesh.vertices[corner.x], u = mesh.vertices[corner.y] - a, v = mesh.vertices[corner.z] - a;
      const glm::dvec3 in_box = (a + (u + v) / 3.0 - body_.low) / (body_.high - body_.low);
      uint64_t morton = 0;
      for (int bit = 9; bit >= 0; --bit)
        for (int k = 0; k < 3; ++k)
          morton = 2 * morton + (static_cast<uint64_t>(1023.0 * std::clamp(in_box[k], 0.0, 1.0)) >> bit & 1);
      found.push_back({morton, {a, u, v, FaceNormal(mesh, t), 0.5 * glm::length(glm::cross(u, v))}});
    }
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  for (const auto& [_, face] : found) faces_.push_back(face);
}

/// About the power that each face and those before it receive from a lamp, were there no shadows. Only the choice of
/// rays depends on it.
std::vector<double> UncollidedRays::LightUpTo(const Lamp& lamp) const {
  constexpr int kPoints = 3;        // along a side of the lamp
  constexpr double kAlways = 0.02;  // of the mean, for faces that these points miss
  std::vector<double> light;
  double sum = 0, area = 0;
  for (const Face& f : faces_) {
    const glm::dvec3 middle = f.corner + (f.side_u + f.side_v) / 3.0;
    double irradiance = 0;
    for (int k = 0; k < kPoints * kPoints; ++k) {
      const glm::dvec2 at = (glm::dvec2(k % kPoints, k / kPoints) + 0.5) / static_cast<double>(kPoints);
      if (const auto point = SampleLightPoint(lamp.shape, middle, at))
        irradiance +=
            lamp.scale * point->radiance.Mean() * std::max(0.0, glm::dot(point->direction, f.normal)) / point->density;
    }
    light.push_back(f.area_mm2 * irradiance);
    sum += light.back(), area += f.area_mm2;
  }
  const double least = sum > 0 ? kAlways * sum / area : 1.0;
  for (size_t f = 0; f < faces_.size(); ++f) light[f] += least * faces_[f].area_mm2 + (f > 0 ? light[f - 1] : 0.0);
  return light;
}

void UncollidedRays::Trace(size_t source, int count, uint64_t key, Receiver& receiver) const {
  double all = 0;
  for (const size_t lamp : sources_[source].lamps) all += light_up_to_[lamp].back();
  UncollidedRay ray;
  for (const size_t lamp : sources_[source].lamps) {
    const double share = light_up_to_[lamp].back() / all;
    TraceLamp(sources_[source], lamp, std::max(1, static_cast<int>(std::lround(share * count))), Key(key, lamp), ray,
              receiver);
  }
}

void UncollidedRays::TraceLamp(const Source& source, size_t lamp, int count, uint64_t key, UncollidedRay& ray,
                               Receiver& receiver) const {
  constexpr double kRatio = 1.1673039782614187;  // x^5 = x + 1
  const std::vector<double>& light_up_to = light_up_to_[lamp];
  std::array<double, 4> at{}, by{};
  for (size_t k = 0; k < at.size(); ++k) at[k] = Uniform(key, k), by[k] = std::pow(kRatio, -static_cast<double>(k + 1));
  for (int number = 0; number < count; ++number) {
    for (size_t k = 0; k < at.size(); ++k)
      if ((at[k] += by[k]) >= 1.0) at[k] -= 1.0;
    const double passed = at[0] * light_up_to.back();
    const size_t f = std::min(
        static_cast<size_t>(std::upper_bound(light_up_to.begin(), light_up_to.end(), passed) - light_up_to.begin()),
        faces_.size() - 1);
    const double before = f > 0 ? light_up_to[f - 1] : 0.0, share = light_up_to[f] - before;
    const Face& face = faces_[f];
    const double p = std::sqrt(std::clamp((passed - before) / share, 0.0, 1.0));
    ray.random = RandomStream(Key(key, 4 + number));
    FromLamp(source, context_.lamps[lamp], face.corner + p * ((1.0 - at[1]) * face.side_u + at[1] * face.side_v), face,
             face.area_mm2 / share * light_up_to.back() / count, {at[2], at[3]}, ray, receiver);
  }
}

std::optional<Boundary> UncollidedRays::NextOutside(const Source& source, const glm::dvec3& from,
                                                    const glm::dvec3& direction, double max_mm) const {
  return context_.scene.Next(from, direction, kOutside, max_mm, nullptr, [&](int opaque) {
    return (context_.opaque[opaque].photographs & source.photographs) != 0;
  });
}

void UncollidedRays::FromLamp(const Source& source, const Lamp& lamp, const glm::dvec3& at, const Face& face,
                              double area_mm2, const glm::dvec2& uniform, UncollidedRay& ray,
                              Receiver& receiver) const {
  constexpr double kSame = 1e-3;  // mm; layers lie further apart
  const auto point = SampleLightPoint(lamp.shape, at, uniform);
  if (!point) return;
  const double cosine = glm::dot(point->direction, face.normal);
  if (cosine <= 0) return;
  // From the lamp's side, so that only the outermost boundary is met.
  const double reach = std::min(point->distance_mm, 2.0 * glm::distance(body_.low, body_.high));
  const glm::dvec3 start = at + reach * point->direction;
  if (reach < point->distance_mm && NextOutside(source, start, point->direction, point->distance_mm - reach)) return;
  const auto met = NextOutside(source, start, -point->direction, reach + kSame);
  if (!met || met->opaque >= 0 || glm::distance(met->position, at) > kSame) return;
  ray.power = area_mm2 * lamp.scale * cosine / point->density * point->radiance;
  Follow(source, *met, -point->direction, ray, receiver);
}

void UncollidedRays::Follow(const Source& source, const Boundary& first, glm::dvec3 direction, UncollidedRay& ray,
                            Receiver& receiver) const {
  // A ray that has left this much goes on for two free paths on average, where most light collides.
  constexpr double kAllAbove = 0.3;
  constexpr double kSurvival = 0.2;
  constexpr int kRouletteAfter = 64;  // boundaries; plane faces of a clear layer trap light
  ray.least = kAllAbove * ray.power.Largest();
  if (!(ray.least > 0)) return;
  ray.length_mm.assign(media_.size(), 0.0);
  ray.textured_mm.assign(media_.has_textures() ? media_.size() : 0, Spectrum(media_.channels(), 0.0));
  ray.last = ray.least * ray.random.Next();
  glm::dvec3 position = first.position;
  int medium = kOutside;
  if (!Cross(first, direction, medium, ray.random)) return;
  for (int boundaries = 1;; ++boundaries) {
    if (boundaries > kRouletteAfter) {
      if (ray.random.Next() >= kSurvival) return;
      ray.power /= kSurvival;
      ray.least /= kSurvival, ray.last /= kSurvival;
    }
    std::optional<Boundary> b;
    if (medium == kOutside) {
      b = NextOutside(source, position, direction, kFar);
    } else {
      const Medium& m = media_[medium];
      const double thinnest = (m.texture ? m.scattering : m.scattering + m.absorption).Smallest(),
                   to_last = std::max(0.0, std::log(ray.power.Largest() / ray.last)),
                   farthest = thinnest > 0 ? to_last / thinnest + receiver.LongestPiece_mm() : kFar;
      b = context_.scene.NextByRay(position, direction, medium, farthest);
      if (!b && std::isinf(farthest)) return;
      if (!receiver.Receive(position, direction, b ? b->distance_mm : farthest, medium, ray)) return;
    }
    if (!b || b->opaque >= 0) return;
    position = b->position;
    if (!Cross(*b, direction, medium, ray.random)) return;
  }
}

/// False where light ends, or goes on as Lambertian light.
bool UncollidedRays::Cross(const Boundary& b, glm::dvec3& direction, int& medium, RandomStream& random) const {
  if (b.is_cut && context_.cut_is_opaque) return false;
  if (b.outside != kOutside && medium != kOutside) {
    direction = ScatterAtSmoothBoundary(direction, b.normal, media_[b.behind(medium)].ior / media_[medium].ior, random);
  } else if (context_.contact && context_.contact->Holds(b.position)) {
    return false;
  } else {
    direction = context_.outer[b.inside].Scatter(direction, b.normal, random, {}, {}).direction;
  }
  medium = b.towards(direction);
  return true;
}

}  // namespace crownfit
