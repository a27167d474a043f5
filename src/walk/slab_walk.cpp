#include "walk/slab_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "optics/shading_terms.h"
#include "walk/boundary.h"
#include "walk/random_walk.h"

namespace crownfit {
namespace {

/// Infinite flat layers below z = 0, in the walk's terms: layer i is medium i + 1, boundary i lies above it. What is
/// below the last layer has the number layers + 1.
class SlabScene {
 public:
  explicit SlabScene(const Slab& slab) : depth_{0.0} {
    for (const auto& layer : slab.layers) depth_.push_back(depth_.back() + layer.thickness_mm);
  }
  std::optional<Boundary> Next(const glm::dvec3& origin, const glm::dvec3& direction, int medium, double max_mm) const {
    if (direction.z == 0) return std::nullopt;
    const int boundary = direction.z < 0 ? medium : medium - 1;
    const double distance = std::max(0.0, (-depth_[boundary] - origin.z) / direction.z);
    if (!(distance <= max_mm)) return std::nullopt;
    glm::dvec3 position = origin + distance * direction;
    position.z = -depth_[boundary];
    return Boundary{distance, position, {0, 0, 1}, boundary + 1, boundary};
  }
  bool Holds(const glm::dvec3&) const { return true; }
  int below() const { return static_cast<int>(depth_.size()); }

 private:
  std::vector<double> depth_;
};

/// Sums over photons of what each returned; every photon ends in one place.
struct Tally {
  double reflected = 0, reflected2 = 0, transmitted = 0, transmitted2 = 0;
  std::vector<double> rings_r, rings_r2, rings_t, rings_t2;
  explicit Tally(size_t rings) : rings_r(rings), rings_r2(rings), rings_t(rings), rings_t2(rings) {}
  void Add(const Tally& o) {
    reflected += o.reflected, reflected2 += o.reflected2, transmitted += o.transmitted, transmitted2 += o.transmitted2;
    for (size_t i = 0; i < rings_r.size(); ++i)
      rings_r[i] += o.rings_r[i], rings_r2[i] += o.rings_r2[i], rings_t[i] += o.rings_t[i],
          rings_t2[i] += o.rings_t2[i];
  }
};

/// Everything that stays the same for all photons.
struct Bench {
  const Slab& slab;
  SlabScene scene;
  Media media;
};

Media MediaOfSlab(const Slab& slab) {
  std::vector<Medium> media(1);
  media[0].ior = slab.ior_above;
  for (const auto& l : slab.layers)
    media.push_back(
        {l.ior, l.g, l.isotropic_fraction, glm::dvec3(l.scattering_per_mm), glm::dvec3(l.absorption_per_mm)});
  media.emplace_back().ior = slab.ior_below;
  return Media(std::move(media));
}

/// One photon from just above the sample, refracted in at `direction` (travelling down). Adds to the tally.
void TracePhoton(const Bench& bench, glm::dvec3 direction, RandomStream& random, WalkCounters& counters, Tally& tally) {
  const Slab& slab = bench.slab;
  const int below = bench.scene.below();
  const double rho = slab.backing_reflectance;
  WalkState state;
  state.Begin(bench.media.size());
  state.direction = direction;
  state.medium = 1;
  double returned = 1.0;  // weight after reflections by the backing
  double absorbed_by_backing = 0, backing_square_radius = 0;
  const auto ring_of = [&](double square_radius) {
    const auto& edges = slab.radii_mm;
    if (tally.rings_r.empty()) return -1;
    const double r = std::sqrt(square_radius);
    const auto it = std::upper_bound(edges.begin(), edges.end(), r);
    return it == edges.begin() || it == edges.end() ? -1 : static_cast<int>(it - edges.begin()) - 1;
  };
  const auto cross = [&](const Boundary& b) {
    const int behind = b.behind(state.medium);
    if (behind == below && slab.backing_contact) {
      state.medium = below;
      return;
    }
    state.direction = ScatterAtSmoothBoundary(state.direction, b.normal,
                                              bench.media[behind].ior / bench.media[state.medium].ior, random);
    state.medium = b.towards(state.direction);
  };
  for (;;) {
    const bool left = Walk(bench.scene, bench.media, 0, state, random, counters, cross,
                           [&](int medium) { return medium == kOutside || medium == below; });
    if (!left) break;
    const double weight = returned * bench.media.Weight(state).x;
    const double square_radius = state.position.x * state.position.x + state.position.y * state.position.y;
    if (state.medium == kOutside) {
      tally.reflected += weight;
      tally.reflected2 += weight * weight;
      if (const int ring = ring_of(square_radius); ring >= 0) {
        tally.rings_r[ring] += weight;
        tally.rings_r2[ring] += weight * weight;
      }
      break;
    }
    // Below: the backing takes 1 - rho (expected value, added up over all returns) and sends rho back.
    absorbed_by_backing += (1.0 - rho) * weight;
    backing_square_radius = square_radius;
    if (rho == 0) break;
    returned *= rho;
    state.direction = SampleLambert({0, 0, 1}, random);
    state.medium = below - 1;
    if (!slab.backing_contact) {
      // Up through an air gap of no width: what the lower face mirrors meets the backing again.
      const double n = slab.layers.back().ior / slab.ior_below;
      state.direction = ScatterAtSmoothBoundary(state.direction, {0, 0, 1}, n, random);
      state.medium = state.direction.z > 0 ? below - 1 : below;
    }
    if (returned < 1e-3) {
      if (random.Next() >= 0.25) break;
      returned *= 4.0;
    }
  }
  tally.transmitted += absorbed_by_backing;
  tally.transmitted2 += absorbed_by_backing * absorbed_by_backing;
  if (const int ring = rho == 0 && absorbed_by_backing > 0 ? ring_of(backing_square_radius) : -1; ring >= 0) {
    tally.rings_t[ring] += absorbed_by_backing;
    tally.rings_t2[ring] += absorbed_by_backing * absorbed_by_backing;
  }
}

double StandardError(double sum, double square, double n) {
  return n > 1 ? std::sqrt(std::max(0.0, square / n - (sum / n) * (sum / n)) / (n - 1)) : 0.0;
}

}  // namespace

SlabAnswer SolveByWalks(const Slab& slab, const SlabWalkOptions& options, const std::function<void(double)>& progress) {
  const Bench bench{slab, SlabScene(slab), MediaOfSlab(slab)};
  SlabAnswer answer;
  answer.model = "path";
  answer.photons = static_cast<double>(options.photons);
  SetSpecular(slab, answer);
  const double n = slab.layers[0].ior / slab.ior_above;
  const size_t rings = slab.radii_mm.empty() ? 0 : slab.radii_mm.size() - 1;
  constexpr uint64_t kBatch = 2000;
  const uint64_t batches = (options.photons + kBatch - 1) / kBatch, diffuse_photons = (options.photons + 3) / 4;
  std::vector<Tally> collimated(batches, Tally(rings)), diffuse(batches, Tally(0));
  const auto run = [&](uint64_t batch, bool is_diffuse, Tally& tally) {
    WalkCounters counters;
    const uint64_t end = std::min(is_diffuse ? diffuse_photons : options.photons, (batch + 1) * kBatch);
    for (uint64_t i = batch * kBatch; i < end; ++i) {
      RandomStream random(Key(options.seed, 0x736c6162ull, is_diffuse, i));
      glm::dvec3 direction(0, 0, -1);
      double entered = 1.0 - answer.specular;
      if (is_diffuse) {
        direction = -SampleLambert({0, 0, 1}, random);
        const double cosine = -direction.z;
        entered = 1.0 - Terms<double>::FresnelReflectance(cosine, n);
        const double inside = Terms<double>::RefractedCosine(cosine, n);
        direction = glm::normalize(glm::dvec3(direction.x / n, direction.y / n, -inside));
      }
      if (random.Next() >= entered) continue;  // mirrored by the first surface
      TracePhoton(bench, direction, random, counters, tally);
    }
  };
  constexpr uint64_t kAtOnce = 64;
  for (uint64_t begin = 0; begin < batches; begin += kAtOnce) {
    ParallelFor(std::min(kAtOnce, batches - begin), options.threads, [&](size_t i) {
      run(begin + i, false, collimated[begin + i]);
      run(begin + i, true, diffuse[begin + i]);
    });
    progress(static_cast<double>(begin) / static_cast<double>(batches));
  }
  Tally c(rings), d(0);
  for (const auto& t : collimated) c.Add(t);
  for (const auto& t : diffuse) d.Add(t);
  const double photons = answer.photons, some = static_cast<double>(diffuse_photons);
  answer.value = {c.reflected / photons, c.transmitted / photons, d.reflected / some, d.transmitted / some};
  answer.stddev = {StandardError(c.reflected, c.reflected2, photons),
                   StandardError(c.transmitted, c.transmitted2, photons),
                   StandardError(d.reflected, d.reflected2, some), StandardError(d.transmitted, d.transmitted2, some)};
  for (size_t i = 0; i < rings; ++i) {
    const double area =
        std::numbers::pi * (slab.radii_mm[i + 1] * slab.radii_mm[i + 1] - slab.radii_mm[i] * slab.radii_mm[i]);
    answer.radial_reflectance_per_mm2.push_back(c.rings_r[i] / photons / area);
    answer.radial_transmittance_per_mm2.push_back(c.rings_t[i] / photons / area);
    answer.radial_reflectance_stddev.push_back(StandardError(c.rings_r[i], c.rings_r2[i], photons) / area);
    answer.radial_transmittance_stddev.push_back(StandardError(c.rings_t[i], c.rings_t2[i], photons) / area);
  }
  return answer;
}

}  // namespace crownfit
