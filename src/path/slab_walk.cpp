#include "path/slab_walk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <tuple>

#include "base/parallel.h"
#include "optics/shading_terms.h"
#include "path/boundary.h"
#include "path/random_walk.h"
#include "path/slab_lanes.h"

namespace crownfit {
namespace {

/// Where a photon left, and its weight; a backing absorbs some of it at every visit.
struct PhotonEnd {
  double reflected = 0, reflected_r2 = 0;      ///< weight, square of the distance from where it entered, mm^2
  double transmitted = 0, transmitted_r2 = 0;  ///< of the last visit
};

/// Everything that all photons share.
struct Bench {
  const Slab& slab;
  std::vector<FlatLayer> layers;

  explicit Bench(const Slab& s) : slab(s), layers(FlatLayersOf(s)) {}
};

/// Walks photons in lanes until the last one has left.
class Pool {
 public:
  Pool(const Bench& bench, int lanes, std::span<PhotonEnd> ends,
       const std::function<std::optional<EnteredPhoton>(size_t)>& start)
      : bench_(bench), ends_(ends), start_(start) {
    while (active_ < lanes && Refill(active_)) ++active_;
  }

  void Trace() {
    while (active_ > 0) {
      lanes_.Fly(active_);
      size_t count = 0;
      for (int i = 0; i < active_; ++i) {
        flown_out_[count] = i;
        count += lanes_.fate[i] != SlabLanes::kCollided;
      }
      lanes_.Cross({flown_out_.data(), count});
      for (size_t k = count; k-- > 0;) {  // from the back: lanes that move up come from there
        const int i = flown_out_[k];
        if (!GoesOn(i) && !Refill(i)) MoveLane(--active_, i);
      }
    }
  }

 private:
  /// Starts the next photon that enters; false when there is none.
  bool Refill(int i) {
    while (next_ < ends_.size()) {
      photon_[i] = next_;
      const auto entered = start_(next_++);
      if (!entered) continue;
      lanes_.x[i] = lanes_.y[i] = lanes_.z[i] = lanes_.depth[i] = 0.0;
      random_[i] = entered->random;
      lanes_.random_step[i] = entered->random.step();
      boundaries_[i] = 0;
      Send(i, entered->direction, entered->random);
      EnterLayer(i, 0);
      return true;
    }
    return false;
  }

  /// Call after Cross for a lane that did not collide: whether its photon is still in a layer.
  bool GoesOn(int i) {
    if (lanes_.fate[i] != SlabLanes::kMeetsBoundary) return false;
    if (lanes_.has_passed[i] != 0) {
      const bool goes_up = lanes_.dz[i] > 0.0;
      if (goes_up && layer_[i] == 0) return LeaveUpwards(i);
      if (goes_up || layer_[i] + 1 < bench_.layers.size())
        EnterLayer(i, goes_up ? layer_[i] - 1 : layer_[i] + 1);
      else if (!ReturnFromBacking(i))
        return false;
    }
    RandomStream random = StreamOf(i);
    const double boost = BoostAtBoundary(++boundaries_[i], random);
    if (boost == 1.0 || boost == 0.0) return boost > 0.0;
    lanes_.random[i] = random.state();
    lanes_.depth[i] -= std::log(boost);
    return true;
  }

  bool LeaveUpwards(int i) {
    PhotonEnd& end = ends_[photon_[i]];
    end.reflected = std::exp(-lanes_.depth[i]);
    end.reflected_r2 = lanes_.x[i] * lanes_.x[i] + lanes_.y[i] * lanes_.y[i];
    return false;
  }

  /// The backing absorbs 1 - rho (expected value, summed over all visits) and reflects rho.
  bool ReturnFromBacking(int i) {
    const Slab& slab = bench_.slab;
    const double rho = slab.backing_reflectance;
    PhotonEnd& end = ends_[photon_[i]];
    end.transmitted_r2 = lanes_.x[i] * lanes_.x[i] + lanes_.y[i] * lanes_.y[i];
    RandomStream random = StreamOf(i);
    for (;;) {
      end.transmitted += (1.0 - rho) * std::exp(-lanes_.depth[i]);
      if (rho == 0) return false;
      lanes_.depth[i] -= std::log(rho);
      if (lanes_.depth[i] > SlabLanes::kDeep) {
        if (random.Next() * SlabLanes::kLiveOfDeep >= 1.0) return false;
        lanes_.depth[i] -= std::log(SlabLanes::kLiveOfDeep);
      }
      glm::dvec3 direction = SampleLambert({0, 0, 1}, random);
      // Up through an air gap of zero width: light that the lower face reflects meets the backing again.
      if (!slab.backing_contact)
        direction = ScatterAtSmoothBoundary(direction, {0, 0, 1}, slab.layers.back().ior / slab.ior_below, random);
      Send(i, direction, random);
      if (direction.z > 0) return true;
    }
  }

  /// The photon's stream, with the state of its lane.
  RandomStream StreamOf(int i) const {
    RandomStream random = random_[i];
    random.set_state(lanes_.random[i]);
    return random;
  }
  void Send(int i, const glm::dvec3& direction, const RandomStream& random) {
    lanes_.dx[i] = direction.x, lanes_.dy[i] = direction.y, lanes_.dz[i] = direction.z;
    lanes_.random[i] = random.state();
  }
  void EnterLayer(int i, size_t layer) {
    layer_[i] = layer;
    lanes_.Enter(i, bench_.layers[layer]);
  }
  void MoveLane(int from, int to) {
    lanes_.Copy(from, to);
    photon_[to] = photon_[from];
    random_[to] = random_[from];
    layer_[to] = layer_[from];
    boundaries_[to] = boundaries_[from];
  }

  const Bench& bench_;
  std::span<PhotonEnd> ends_;
  const std::function<std::optional<EnteredPhoton>(size_t)>& start_;
  SlabLanes lanes_{};
  std::vector<RandomStream> random_{SlabLanes::kMax, RandomStream(0)};
  std::array<size_t, SlabLanes::kMax> photon_{}, layer_{};
  std::array<int, SlabLanes::kMax> boundaries_{}, flown_out_{};
  int active_ = 0;
  size_t next_ = 0;
};

/// Sums over photons, and sums of squares.
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
  /// `edges`: of the rings. Rings below count light only where no backing reflects.
  void Add(const PhotonEnd& end, const std::vector<double>& edges, bool has_rings_below) {
    reflected += end.reflected, reflected2 += end.reflected * end.reflected;
    transmitted += end.transmitted, transmitted2 += end.transmitted * end.transmitted;
    const auto add = [&](double weight, double square_radius, std::vector<double>& sums, std::vector<double>& squares) {
      if (!(weight > 0) || sums.empty()) return;
      const auto it = std::upper_bound(edges.begin(), edges.end(), std::sqrt(square_radius));
      if (it == edges.begin() || it == edges.end()) return;
      const size_t ring = it - edges.begin() - 1;
      sums[ring] += weight;
      squares[ring] += weight * weight;
    };
    add(end.reflected, end.reflected_r2, rings_r, rings_r2);
    if (has_rings_below) add(end.transmitted, end.transmitted_r2, rings_t, rings_t2);
  }
};

}  // namespace

double StandardError(double sum, double square, double n) {
  return n > 1 ? std::sqrt(std::max(0.0, square / n - (sum / n) * (sum / n)) / (n - 1)) : 0.0;
}

std::vector<FlatLayer> FlatLayersOf(const Slab& s) {
  std::vector<FlatLayer> layers;
  double top = 0;
  for (size_t i = 0; i < s.layers.size(); ++i) {
    const SlabLayer& l = s.layers[i];
    const bool is_last = i + 1 == s.layers.size();
    const double above = i == 0 ? s.ior_above : s.layers[i - 1].ior,
                 below = !is_last            ? s.layers[i + 1].ior
                         : s.backing_contact ? l.ior  // as if there were no boundary above the backing
                                             : s.ior_below;
    layers.push_back({top, top - l.thickness_mm,
                      l.scattering_per_mm > 0 ? 1.0 / l.scattering_per_mm : FlatLayer::kNoCollision,
                      l.absorption_per_mm, l.g, l.isotropic_fraction, above / l.ior, below / l.ior});
    top -= l.thickness_mm;
  }
  return layers;
}

std::optional<EnteredPhoton> EnterSlab(const Slab& slab, double specular, bool is_diffuse, uint64_t key) {
  RandomStream random(key);
  glm::dvec3 direction(0, 0, -1);
  double entered = 1.0 - specular;
  if (is_diffuse) {
    const double n = slab.layers[0].ior / slab.ior_above;
    direction = -SampleLambert({0, 0, 1}, random);
    const double cosine = -direction.z;
    entered = 1.0 - Terms<double>::FresnelReflectance(cosine, n);
    const double inside = Terms<double>::RefractedCosine(cosine, n);
    direction = glm::normalize(glm::dvec3(direction.x / n, direction.y / n, -inside));
  }
  if (random.Next() >= entered) return std::nullopt;
  return EnteredPhoton{direction, random};
}

SlabAnswer SolveByWalks(const Slab& slab, const SlabWalkOptions& options, const std::function<void(double)>& progress) {
  const Bench bench(slab);
  SlabAnswer answer;
  answer.model = Model::kPath;
  answer.photons = static_cast<double>(options.photons);
  SetSpecular(slab, answer);
  const size_t rings = slab.radii_mm.empty() ? 0 : slab.radii_mm.size() - 1;
  constexpr uint64_t kBatch = 4000, kPerDiffuse = 4;
  const uint64_t batches = (options.photons + kBatch - 1) / kBatch,
                 diffuse_photons = (options.photons + kPerDiffuse - 1) / kPerDiffuse;
  std::vector<Tally> collimated(batches, Tally(rings)), diffuse(batches, Tally(0));
  const auto run = [&](uint64_t batch) {
    const auto range = [&](uint64_t size, uint64_t all) {
      return std::pair(batch * size, std::min(all, (batch + 1) * size));
    };
    uint64_t first, last, first_diffuse, last_diffuse;  // no bindings: clang 14 captures none
    std::tie(first, last) = range(kBatch, options.photons);
    std::tie(first_diffuse, last_diffuse) = range(kBatch / kPerDiffuse, diffuse_photons);
    const size_t count = last - first;
    std::vector<PhotonEnd> ends(count + (last_diffuse - first_diffuse));
    const std::function start = [&](size_t k) {
      const bool is_diffuse = k >= count;
      const uint64_t photon = is_diffuse ? first_diffuse + (k - count) : first + k;
      return EnterSlab(slab, answer.specular, is_diffuse, Key(options.seed, 0x736c6162ull, is_diffuse, photon));
    };
    Pool(bench, std::clamp(options.lanes, 1, SlabLanes::kMax), ends, start).Trace();
    for (size_t k = 0; k < ends.size(); ++k)
      (k < count ? collimated : diffuse)[batch].Add(ends[k], slab.radii_mm, slab.backing_reflectance == 0);
  };
  constexpr uint64_t kAtOnce = 64;
  for (uint64_t begin = 0; begin < batches; begin += kAtOnce) {
    ParallelFor(std::min(kAtOnce, batches - begin), options.threads, [&](size_t i) { run(begin + i); });
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
