#include "path/slab_diffusion.h"

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "path/boundary.h"
#include "path/diffuse_boundary.h"
#include "path/medium.h"
#include "path/random_walk.h"
#include "path/slab_walk.h"

namespace crownfit {
namespace {

double ReducedScattering(const FlatLayer& l) {
  return (1.0 - (1.0 - l.isotropic_fraction) * l.g) / l.free_path_mm;  // 0 in a clear layer
}

/// sinh(a x) / sinh(a y) for 0 <= x <= y.
double SinhRatio(double a, double x, double y) {
  if (!(a * y > 1e-6)) return y > 0 ? x / y : 0.0;
  return std::exp(-a * (y - x)) * std::expm1(-2.0 * a * x) / std::expm1(-2.0 * a * y);
}

using Shares = FlatEscape::Shares;

/// The random-walk part of one photon's path.
class Photon {
 public:
  Photon(const std::vector<FlatLayer>& layers, const FlatEscape& escape, int collisions)
      : layers_(layers), escape_(escape), collisions_(collisions) {}

  /// `height_mm`: above the layer's bottom.
  Shares Follow(glm::dvec3 direction, size_t layer, double height_mm, RandomStream random) const {
    double left = 1.0;
    int boundaries = 0;
    for (int to_go = collisions_;;) {
      const FlatLayer& l = layers_[layer];
      const double thickness = l.top_mm - l.bottom_mm;
      const double scattering = to_go > 0 ? 1.0 / l.free_path_mm : ReducedScattering(l);
      const double flight = scattering > 1e-200 ? -std::log(1.0 - random.Next()) / scattering : HUGE_VAL;
      const double to_face = direction.z > 0   ? (thickness - height_mm) / direction.z
                             : direction.z < 0 ? -height_mm / direction.z
                                               : HUGE_VAL;
      const double length = std::max(0.0, std::min(flight, to_face));
      if (std::isinf(length)) return {0.0, 0.0};  // never leaves a clear layer
      left *= std::exp(-l.absorption_per_mm * length);
      if (left < kNothing) return {0.0, 0.0};
      height_mm += direction.z * length;
      if (flight < to_face) {
        if (to_go-- == 0) {
          const Shares s = escape_.From(layer, std::clamp(height_mm, 0.0, thickness));
          return {left * s.up, left * s.down};
        }
        direction = SamplePhaseFunction({1.0, l.g, l.isotropic_fraction}, direction, random);
        continue;
      }
      left *= BoostAtBoundary(++boundaries, random);
      const bool goes_up = direction.z > 0;
      direction = ScatterAtSmoothBoundary(direction, {0, 0, 1}, goes_up ? l.ior_above : l.ior_below, random);
      if ((direction.z > 0) != goes_up) {
        height_mm = goes_up ? thickness : 0.0;
        continue;
      }
      if (goes_up && layer == 0) return {left, 0.0};
      if (!goes_up && layer + 1 == layers_.size()) return {0.0, left};
      layer = goes_up ? layer - 1 : layer + 1;
      height_mm = goes_up ? 0.0 : layers_[layer].top_mm - layers_[layer].bottom_mm;
    }
  }

 private:
  static constexpr double kNothing = 1e-30;
  const std::vector<FlatLayer>& layers_;
  const FlatEscape& escape_;
  const int collisions_;
};

/// Sums over photons, and sums of squares.
struct Tally {
  double up = 0, up2 = 0, down = 0, down2 = 0, count = 0;
  void Add(const Shares& s) { up += s.up, up2 += s.up * s.up, down += s.down, down2 += s.down * s.down, ++count; }
  void Add(const Tally& o) { up += o.up, up2 += o.up2, down += o.down, down2 += o.down2, count += o.count; }
  Shares mean() const { return {up / count, down / count}; }
  Shares error() const { return {StandardError(up, up2, count), StandardError(down, down2, count)}; }
};

}  // namespace

FlatEscape::FlatEscape(const std::vector<FlatLayer>& layers) {
  constexpr double kFarthest = 1e3;     // mm: largest transport mean free path, as in the volume
  constexpr double kMostCoupled = 1e7;  // coupling of faces at zero distance: more would cost the leaks digits
  const size_t count = layers.size();
  std::vector<double> diagonal(count + 1, 0.0), beside(count, 0.0);
  double index = 1.0;  // of the layer, over that above the slab
  for (size_t i = 0; i < count; ++i) {
    const FlatLayer& l = layers[i];
    index = i == 0 ? 1.0 / l.ior_above : index / l.ior_above;
    const double diffusion = 1.0 / (3.0 * std::max(ReducedScattering(l) + l.absorption_per_mm, 1.0 / kFarthest));
    const double d = l.top_mm - l.bottom_mm, k = std::sqrt(l.absorption_per_mm / diffusion);
    thickness_mm_.push_back(d);
    decay_.push_back(k);
    const double depth = k * d, conduction = index * index * diffusion;
    // conduction k / sinh(depth), and conduction k (coth - 1 / sinh) = conduction k tanh(depth / 2).
    beside[i] =
        std::min(kMostCoupled,
                 depth > 1e-6 ? conduction * k * 2.0 * std::exp(-depth) / -std::expm1(-2.0 * depth) : conduction / d);
    const double sink = conduction * k * std::tanh(0.5 * depth);
    diagonal[i] += beside[i] + sink;
    diagonal[i + 1] += beside[i] + sink;
  }
  // Only ratios of indices matter at a boundary.
  const double index_top = 1.0 / layers[0].ior_above;
  const double leak_up = PassedBy({0.0, 0.0, index_top, 1.0}).Leak(index_top * index_top),
               leak_down = PassedBy({0.0, 0.0, index, index * layers.back().ior_below}).Leak(index * index);
  diagonal[0] += leak_up;
  diagonal[count] += leak_down;
  std::vector<Shares> right(count + 1, {0.0, 0.0});
  right[0].up = leak_up;
  right[count].down = leak_down;
  for (size_t i = 1; i <= count; ++i) {
    const double share = beside[i - 1] / diagonal[i - 1];
    diagonal[i] -= share * beside[i - 1];
    right[i].up += share * right[i - 1].up;
    right[i].down += share * right[i - 1].down;
  }
  at_.resize(count + 1);
  for (size_t i = count + 1; i-- > 0;) {
    const Shares below = i < count ? at_[i + 1] : Shares{0.0, 0.0};
    const double coupled = i < count ? beside[i] : 0.0;
    at_[i] = {(right[i].up + coupled * below.up) / diagonal[i], (right[i].down + coupled * below.down) / diagonal[i]};
  }
}

FlatEscape::Shares FlatEscape::From(size_t layer, double height_mm) const {
  const double d = thickness_mm_[layer], a = decay_[layer], of_top = SinhRatio(a, height_mm, d),
               of_bottom = SinhRatio(a, d - height_mm, d);
  const Shares &top = at_[layer], &bottom = at_[layer + 1];
  return {of_top * top.up + of_bottom * bottom.up, of_top * top.down + of_bottom * bottom.down};
}

SlabAnswer SolveByDiffusion(const Slab& slab, const SlabDiffusionOptions& options,
                            const std::function<void(double)>& progress) {
  const std::vector<FlatLayer> layers = FlatLayersOf(slab);
  const FlatEscape escape(layers);
  const Photon photon(layers, escape, options.collisions);
  SlabAnswer answer;
  answer.model = Model::kDiffusion;
  answer.photons = static_cast<double>(options.photons);
  SetSpecular(slab, answer);
  enum Kind { kCollimated, kDiffuse, kFromBelow, kKinds };
  const double rho = slab.backing_reflectance;
  const auto one = [&](Kind kind, uint64_t number) -> Shares {
    const uint64_t key = Key(options.seed, 0x646966666cull, kind, number);
    if (kind != kFromBelow) {
      const auto entered = EnterSlab(slab, answer.specular, kind == kDiffuse, key);
      if (!entered) return {0.0, 0.0};
      return photon.Follow(entered->direction, 0, layers[0].top_mm - layers[0].bottom_mm, entered->random);
    }
    RandomStream random(key);
    const glm::dvec3 direction =
        ScatterAtSmoothBoundary(SampleLambert({0, 0, 1}, random), {0, 0, 1}, 1.0 / layers.back().ior_below, random);
    if (direction.z < 0) return {0.0, 1.0};
    return photon.Follow(direction, layers.size() - 1, 0.0, random);
  };
  Tally of[kKinds];
  for (int kind = 0; kind < kKinds; ++kind) {
    if (kind == kFromBelow && rho == 0) continue;
    constexpr uint64_t kBatch = 4000, kAtOnce = 64;
    const uint64_t photons = kind == kCollimated ? options.photons : (options.photons + 3) / 4,
                   batches = (photons + kBatch - 1) / kBatch;
    std::vector<Tally> tallies(batches);
    for (uint64_t begin = 0; begin < batches; begin += kAtOnce) {
      ParallelFor(std::min(kAtOnce, batches - begin), options.threads, [&](size_t i) {
        const uint64_t batch = begin + i, end = std::min(photons, (batch + 1) * kBatch);
        for (uint64_t k = batch * kBatch; k < end; ++k) tallies[batch].Add(one(static_cast<Kind>(kind), k));
      });
      progress(static_cast<double>(begin) / static_cast<double>(batches));
    }
    for (const Tally& t : tallies) of[kind].Add(t);
  }
  // The backing reflects a share rho diffusely, repeatedly.
  const auto add_up = [&](const Tally& t, double& reflected, double& transmitted, double& reflected_error,
                          double& transmitted_error) {
    const Shares mean = t.mean(), error = t.error();
    reflected = mean.up, transmitted = mean.down, reflected_error = error.up, transmitted_error = error.down;
    if (rho == 0) return;
    const Shares back = of[kFromBelow].mean(), back_error = of[kFromBelow].error();
    const double again = rho / std::max(1.0 - rho * back.down, 1e-12), sent = again * mean.down,
                 taken = (1.0 - rho) / rho;
    reflected += sent * back.up;
    transmitted = taken * sent;
    reflected_error = std::hypot(error.up, again * back.up * error.down,
                                 sent * std::hypot(back_error.up, again * back.up * back_error.down));
    transmitted_error = taken * again * std::hypot(error.down, sent * back_error.down);
  };
  SlabTotals &v = answer.value, &e = answer.stddev;
  add_up(of[kCollimated], v.reflectance_collimated, v.transmittance_collimated, e.reflectance_collimated,
         e.transmittance_collimated);
  add_up(of[kDiffuse], v.reflectance_diffuse, v.transmittance_diffuse, e.reflectance_diffuse, e.transmittance_diffuse);
  return answer;
}

}  // namespace crownfit
