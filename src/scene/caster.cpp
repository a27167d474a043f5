#include "scene/caster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/parallel.h"

namespace crownfit {
namespace {

constexpr double kLift_mm = 2e-3;  // rays into the air start this far above the surface

/// One light's samples are summed in bands of incidence, because Fresnel's reflectance is steep at grazing angles. One
/// mean angle for a whole dome would transmit 4 % too much light; three leave 0.3 %.
constexpr double kBandEdges[] = {0.25, 0.55};
constexpr int kBands = 3;
int BandOf(double cos_incidence) { return (cos_incidence > kBandEdges[0]) + (cos_incidence > kBandEdges[1]); }

struct ShareSum {
  Spectrum irradiance;
  double weight = 0, cosine = 0;
  void Add(const LightSample& s, double cos_incidence) {
    const Spectrum e = s.weight * cos_incidence;
    const double w = e.Sum();
    irradiance += e;
    weight += w;
    cosine += w * cos_incidence;
  }
};

void AddShare(int light, const ShareSum& sum, LightShares& shares) {
  if (!(sum.weight > 0)) return;
  shares.each.push_back({light, sum.cosine / sum.weight});
  shares.irradiance.push_back(sum.irradiance);
}

}  // namespace

Caster::Caster(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery, size_t photograph,
               const CastOptions& options)
    : photo_(capture.photographs[photograph]),
      options_(options),
      tile_(photo_.backing ? BackingTile(capture.backings[*photo_.backing], crown) : TriangleMesh()),
      caster_({}) {
  const RigidTransform object_from_camera = photo_.camera_from_object.Inverse();
  camera_ = object_from_camera.translation_mm;
  for (size_t i : photo_.lights) {
    const Light& light = capture.lights[i];
    lights_.push_back({static_cast<int>(i),
                       light.in_camera_frame ? Transformed(light.shape, object_from_camera) : light.shape,
                       light.intensity_scale});
  }
  std::vector<const TriangleMesh*> meshes{&crown.fine};
  reflectance_.emplace_back(capture.channels(), 0.0);
  for (size_t i : photo_.scenery) {
    meshes.push_back(&scenery[i]);
    reflectance_.push_back(capture.scenery[i].reflectance);
  }
  if (photo_.backing) {
    meshes.push_back(&tile_);
    reflectance_.push_back(capture.backings[*photo_.backing].reflectance);
  }
  meshes_ = meshes;
  caster_ = RayCaster(meshes);
  if (photo_.backing) TabulateTile(capture.backings[*photo_.backing], crown);
}

void Caster::Gather(const glm::dvec3& position, const glm::dvec3& normal, int lamp_strata, LightShares& shares,
                    float* visibility) const {
  const glm::dvec3 lifted = position + kLift_mm * normal;
  std::vector<LightSample> samples;
  for (size_t l = 0; l < lights_.size(); ++l) {
    const auto& [index, shape, intensity] = lights_[l];
    samples.clear();
    SampleLight(shape, position, normal, IsAllAround(shape) ? 2 * lamp_strata : lamp_strata, samples);
    std::array<ShareSum, kBands> sums;
    double sent = 0, arrived = 0;
    for (const LightSample& s : samples) {
      const double cosine = glm::dot(s.direction, normal);
      if (cosine <= 0) continue;
      sent += s.weight.Sum() * cosine;
      if (caster_.Occluded(lifted, s.direction, 0.0, s.distance_mm)) continue;
      arrived += s.weight.Sum() * cosine;
      sums[BandOf(cosine)].Add(s, cosine);
    }
    for (const ShareSum& sum : sums) AddShare(index, sum, shares);
    if (visibility) visibility[l] = static_cast<float>(sent > 0 ? arrived / sent : 0.0);
  }
}

void Caster::AddHighlights(const glm::dvec3& position, const glm::dvec3& normal, const glm::dvec3& view,
                           std::span<const float> visibility, Highlights& highlights) const {
  if (photo_.polarisation == Polarisation::kCross) return;
  std::vector<LightSample> samples;
  for (size_t l = 0; l < lights_.size(); ++l) {
    const auto& [index, shape, intensity] = lights_[l];
    samples.clear();
    if (IsAllAround(shape)) {
      SampleAllAroundForGloss(shape, normal, view, options_.gloss_roughness, options_.strata, samples);
    } else {
      SampleLight(shape, position, normal, options_.strata, samples);
    }
    for (const LightSample& s : samples) {
      const double cosine = glm::dot(s.direction, normal);
      if (cosine <= 0 || visibility[l] <= 0) continue;
      const glm::dvec3 half = glm::normalize(s.direction + view);
      highlights.each.push_back({index, static_cast<float>(cosine), static_cast<float>(glm::dot(half, normal)),
                                 static_cast<float>(glm::dot(s.direction, half))});
      highlights.irradiance.push_back(visibility[l] * cosine * s.weight);
    }
  }
}

BackingShare Caster::GatherScenery(const glm::dvec3& position, const glm::dvec3& normal, LightShares& shares) const {
  BackingShare backing;
  if (reflectance_.size() < 2) return backing;
  const glm::dvec3 lifted = position + kLift_mm * normal;
  std::vector<LightSample> sky;
  SampleLight(DomeLight{Spectrum(1.0)}, position, normal, options_.gather_strata, sky);
  std::vector<std::array<ShareSum, kBands>> sums(lights_.size());
  for (size_t i = 0; i < sky.size(); ++i) {
    const auto hit = caster_.Nearest(lifted, sky[i].direction);
    if (!hit || hit->mesh == 0) continue;
    std::vector<Spectrum> radiance;
    const bool is_tile = photo_.backing && hit->mesh + 1 == static_cast<int>(meshes_.size());
    if (is_tile && glm::dot(tile_normal_, sky[i].direction) < 0) {
      const TileGrid::Around around = tile_grid_->At(lifted + hit->distance_mm * sky[i].direction);
      double seen = 0;
      radiance.assign(lights_.size(), Spectrum());
      for (size_t k = 0; k < around.place.size(); ++k) {
        const size_t place = around.place[k];
        seen += around.weight[k] * object_seen_[place];
        for (size_t l = 0; l < lights_.size(); ++l)
          radiance[l] += around.weight[k] * tile_radiance_[place * lights_.size() + l];
      }
      backing.reflectance += seen / static_cast<double>(sky.size()) * reflectance_[hit->mesh];
    } else {
      radiance = SceneryRadiance(*hit, sky[i].direction, std::max(1, options_.strata / 2));
    }
    const double cosine = glm::dot(sky[i].direction, normal);
    for (size_t l = 0; l < lights_.size(); ++l) {
      if (radiance[l].IsZero()) continue;
      sums[l][BandOf(cosine)].Add({sky[i].direction, hit->distance_mm, radiance[l] * sky[i].weight}, cosine);
    }
  }
  for (size_t l = 0; l < lights_.size(); ++l)
    for (const ShareSum& sum : sums[l]) AddShare(lights_[l].index, sum, shares);
  return backing;
}

std::vector<Spectrum> Caster::SceneryRadiance(const Hit& hit, const glm::dvec3& direction, int lamp_strata) const {
  glm::dvec3 normal = FaceNormal(*meshes_[hit.mesh], hit.point.triangle);
  if (glm::dot(normal, direction) > 0) normal = -normal;  // sheets are seen from both sides
  return Radiance(hit.mesh, Position(*meshes_[hit.mesh], hit.point), normal, lamp_strata);
}

std::vector<ShadedMesh> Caster::ShadedScenery() const {
  std::vector<ShadedMesh> all;
  for (size_t m = 1; m < meshes_.size(); ++m) all.push_back(Shaded(m));
  return all;
}

Spectrum Caster::SceneryShown(const Hit& hit, const glm::dvec3& direction) const {
  const glm::dvec3 normal = FaceNormal(*meshes_[hit.mesh], hit.point.triangle);
  return Shown(hit.mesh, Position(*meshes_[hit.mesh], hit.point), glm::dot(normal, direction) > 0 ? -normal : normal,
               options_.strata);
}

void Caster::Mirror(const glm::dvec3& position, const glm::dvec3& normal, const glm::dvec3& direction, double share,
                    std::vector<Mirrored>& mirrored) const {
  const glm::dvec3 towards = glm::reflect(direction, normal), lifted = position + kLift_mm * normal;
  if (photo_.polarisation == Polarisation::kCross || glm::dot(towards, normal) <= 0) return;
  for (const auto& [index, shape, intensity] : lights_) {
    const auto met = LightAlong(shape, lifted, towards);
    if (met && !caster_.Occluded(lifted, towards, 0.0, met->distance_mm))
      mirrored.push_back({index, share * met->radiance});
  }
}

glm::dvec3 Caster::PixelDirection(double x, double y) const {
  return glm::transpose(photo_.camera_from_object.rotation) * DirectionFromPixel(photo_.camera, {x, y});
}

std::vector<Spectrum> Caster::Radiance(int mesh, const glm::dvec3& place, const glm::dvec3& normal,
                                       int lamp_strata) const {
  LightShares shares;
  Gather(place, normal, lamp_strata, shares);
  std::vector<Spectrum> radiance(lights_.size());
  for (size_t s = 0; s < shares.each.size(); ++s)
    for (size_t l = 0; l < lights_.size(); ++l)
      if (lights_[l].index == shares.each[s].light)
        radiance[l] += reflectance_[mesh] * shares.irradiance[s] / std::numbers::pi;
  return radiance;
}

void Caster::TabulateTile(const BackingSpec& spec, const Crown& crown) {
  tile_grid_.emplace(spec);
  tile_normal_ = FaceNormal(tile_, 0);
  object_seen_ = ObjectSeenFrom(*tile_grid_, tile_normal_, crown, options_.threads);
  tile_radiance_.resize(TileGrid::count() * lights_.size());
  ParallelFor(TileGrid::count(), options_.threads, [&](size_t i) {
    const auto at = Radiance(static_cast<int>(meshes_.size()) - 1, tile_grid_->Place(i), tile_normal_, options_.strata);
    std::copy(at.begin(), at.end(), tile_radiance_.begin() + static_cast<std::ptrdiff_t>(i * lights_.size()));
  });
}

Spectrum Caster::Shown(size_t mesh, const glm::dvec3& place, const glm::dvec3& normal, int lamp_strata) const {
  LightShares shares;
  Gather(place, normal, lamp_strata, shares);
  Spectrum irradiance;
  for (size_t s = 0; s < shares.each.size(); ++s)
    for (const PhotographLight& light : lights_)
      if (light.index == shares.each[s].light) irradiance += light.intensity * shares.irradiance[s];
  return reflectance_[mesh] * irradiance;
}

ShadedMesh Caster::Shaded(size_t mesh) const {
  constexpr double kTriangles = 8000, kFinest_mm = 0.4;
  const bool is_tile = photo_.backing && mesh + 1 == meshes_.size();
  ShadedMesh shaded;
  shaded.mesh = Refined(*meshes_[mesh], std::max(kFinest_mm, std::sqrt(2.0 * Area(*meshes_[mesh]) / kTriangles)));
  const std::vector<glm::dvec3>& at = shaded.mesh.vertices;
  std::vector<glm::dvec3> normals(at.size(), glm::dvec3(0.0));
  for (const glm::ivec3& t : shaded.mesh.triangles)
    for (int k = 0; k < 3; ++k) normals[t[k]] += glm::cross(at[t.y] - at[t.x], at[t.z] - at[t.x]);
  shaded.front.resize(at.size());
  if (!is_tile) shaded.back.resize(at.size());
  ParallelFor(at.size(), options_.threads, [&](size_t v) {
    if (normals[v] == glm::dvec3(0.0)) return;
    const glm::dvec3 normal = glm::normalize(normals[v]);
    shaded.front[v] = Shown(mesh, at[v], normal, options_.strata);
    if (!is_tile) shaded.back[v] = Shown(mesh, at[v], -normal, options_.strata);
  });
  return shaded;
}

TriangleMesh Caster::BackingTile(const BackingSpec& b, const Crown& crown) {
  const auto [low, high] = Bounds(crown.fine);
  const bool faces_object = glm::dot(0.5 * (low + high) - b.point_mm, b.normal) >= 0;
  return SquareTile(b.point_mm, faces_object ? b.normal : -b.normal, b.size_mm);
}

}  // namespace crownfit
