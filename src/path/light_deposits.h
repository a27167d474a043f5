#pragma once
// Fluence and diffuse source that light rays deposit on the lattice, for one channel, with derivatives.

#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "path/light_rays.h"

namespace crownfit {

/// One channel's coefficients of the diffusion equation, per layer.
struct DiffusingMedia {
  std::vector<double> scattering, absorption, index2, conduction, sink;  ///< reduced; (n / n outside)^2; n^2 D; n^2 sa
  std::vector<const AbsorptionTexture*> texture;
  std::vector<double> leak;         ///< per boundary piece
  std::vector<double> leak_by_cut;  ///< per boundary piece: derivative by ln of the neck cut's reflectance; empty: none
  int channel;

  double extinction(size_t l) const { return scattering[l] + absorption[l]; }
};

/// Derivatives by ln reduced scattering and ln absorption of every layer.
struct ByCoefficient {
  std::vector<double> scattering, absorption;
};

/// Deposits of rays at the nodes, one channel, with derivatives. `fluence`: fluence over n^2, times volume, of light up
/// to the end of the flight after which diffusion takes over. `source`: the source of diffuse light.
struct Deposits {
  struct Nodes {
    std::vector<double> fluence, source;
    explicit Nodes(size_t nodes) : fluence(nodes, 0.0), source(nodes, 0.0) {}
    void Add(const LatticeStencil& s, double fluence_here, double source_here) {
      for (int k = 0; k < 8; ++k) {
        fluence[s.node[k]] += s.weight[k] * fluence_here;
        if (source_here != 0) source[s.node[k]] += s.weight[k] * source_here;
      }
    }
    void Add(const Nodes& other) {
      for (size_t k = 0; k < fluence.size(); ++k) fluence[k] += other.fluence[k], source[k] += other.source[k];
    }
  };
  Nodes value;
  std::vector<Nodes> by;  ///< by scattering and by absorption, layer by layer; empty: no derivatives
  Deposits(size_t layers, size_t nodes, bool derivatives)
      : value(nodes), by(derivatives ? 2 * layers : 0, Nodes(nodes)) {}
  void Add(const Deposits& other) {
    value.Add(other.value);
    for (size_t k = 0; k < by.size(); ++k) by[k].Add(other.by[k]);
  }
};

/// (1 - exp(-s d)) / s, and its derivative by s.
inline std::pair<double, double> MeanOverStep(double s, double d) {
  const double x = s * d;
  if (x < 1e-3) return {d * (1.0 - x * (0.5 - x / 6.0)), -d * d * (0.5 - x / 3.0)};
  const double e = std::exp(-x), mean = (1.0 - e) / s;
  return {mean, (d * e - mean) / s};
}

/// Follows rays through one channel's media.
class RayFollower {
 public:
  RayFollower(const DiffusingMedia& media, const Media& walked, const VolumeLattice& lattice)
      : media_(media), walked_(walked), lattice_(lattice) {
    for (size_t l = 0; l < layers(); ++l) {
      true_scattering_.push_back(walked[static_cast<int>(l + 1)].scattering);
      log_scattering_.push_back(true_scattering_[l].Mapped([](double s) { return s > 0 ? std::log(s) : 0.0; }));
    }
  }

  size_t layers() const { return media_.scattering.size(); }

  /// Calls visit(step, power x path within the step, its derivatives) along one ray, which starts with `power`.
  template <bool kSlopes, class Visit>
  void Follow(const LightRays& rays, const LightRay& ray, double power, const Visit& visit) {
    flown_.assign(layers(), 0.0), reduced_ = collisions_ = flown_;
    by_.scattering.resize(layers()), by_.absorption.resize(layers());
    double left = power;
    std::vector<double> absorbed(layers(), 0.0);
    for (size_t i = ray.first_step; i < ray.first_step + ray.steps; ++i) {
      const LightStep& step = rays.steps[i];
      const size_t l = step.medium - 1;
      const double factor =
          media_.texture[l] ? media_.texture[l]->At(lattice_.PositionOf(step.middle), media_.channel) : 1.0;
      const double absorption = factor * media_.absorption[l], d = step.length_mm;
      const double scattering = step.is_reduced ? media_.scattering[l] : 0.0, extinction = absorption + scattering;
      if (!step.is_reduced) flown_[l] += 0.5 * d;
      const auto [mean, mean_by] = MeanOverStep(extinction, d);
      const double arrives = left * rays.carried.at(step.carried, media_.channel) * Chance(), track = arrives * mean;
      for (size_t k = 0; kSlopes && k < layers(); ++k) {
        by_.scattering[k] = track * (collisions_[k] - true_scattering_[k][media_.channel] * flown_[k] -
                                     media_.scattering[k] * reduced_[k]);
        by_.absorption[k] = -track * media_.absorption[k] * absorbed[k];
      }
      by_.scattering[l] += scattering * arrives * mean_by;
      by_.absorption[l] += absorption * arrives * mean_by;
      visit(step, l, track, by_);
      left *= std::exp(-extinction * d);
      absorbed[l] += factor * d;
      if (step.is_reduced)
        reduced_[l] += d;
      else
        flown_[l] += 0.5 * d;
      if (step.collides) collisions_[l] += 1.0;
    }
  }

 private:
  /// Probability density of the path so far in this channel, over that for a random hero channel.
  double Chance() const {
    if (walked_.heroes() == 1) return 1.0;
    Spectrum log_chance(walked_.channels(), 0.0);
    for (size_t l = 0; l < layers(); ++l)
      log_chance += collisions_[l] * log_scattering_[l] - true_scattering_[l] * flown_[l];
    return walked_.heroes() / Exp(log_chance - log_chance[media_.channel]).Sum();
  }
  const DiffusingMedia& media_;
  const Media& walked_;
  const VolumeLattice& lattice_;
  std::vector<Spectrum> true_scattering_, log_scattering_;  ///< per layer
  std::vector<double> flown_, reduced_, collisions_;
  ByCoefficient by_;
};

/// Deposits rays of lamps, or returning rays (`of_pieces`: power that leaves each boundary piece).
inline void Deposit(const DiffusingMedia& media, RayFollower& follower, const VolumeLattice& lattice,
                    const LightRays& rays, std::span<const double> of_pieces, Deposits& d) {
  const auto follow = [&](const LightRay& ray, double power, const auto& visit) {
    d.by.empty() ? follower.Follow<false>(rays, ray, power, visit) : follower.Follow<true>(rays, ray, power, visit);
  };
  for (const LightRay& ray : rays.rays) {
    const double power = ray.piece < 0 ? 1.0 : of_pieces[ray.piece];
    if (power == 0) continue;
    follow(ray, power, [&](const LightStep& step, size_t l, double track, const ByCoefficient& by) {
      const LatticeStencil s = lattice.StencilOf(step.middle);
      const double to_source = step.is_reduced ? media.scattering[l] : 0.0, to_fluence = 1.0 / media.index2[l];
      d.value.Add(s, to_fluence * track, to_source * track);
      if (d.by.empty()) return;
      for (size_t k = 0; k < follower.layers(); ++k) {
        const double direct = k == l ? track : 0.0;  // the source is proportional to the coefficient itself
        d.by[2 * k].Add(s, to_fluence * by.scattering[k], to_source * (by.scattering[k] + direct));
        d.by[2 * k + 1].Add(s, to_fluence * by.absorption[k], to_source * by.absorption[k]);
      }
    });
  }
}

/// Returning rays, as a sparse matrix from the power that leaves boundary pieces to sources and fluences at nodes.
class Returns {
 public:
  Returns(const DiffusingMedia& media, RayFollower& follower, const VolumeLattice& lattice, const LightRays& rays) {
    Deposits::Nodes sum(lattice.nodes().count());
    std::vector<int> touched;
    for (size_t r = 0; r < rays.rays.size(); ++r) {
      const int piece = rays.rays[r].piece;
      follower.Follow<false>(rays, rays.rays[r], 1.0,
                             [&](const LightStep& step, size_t l, double track, const ByCoefficient&) {
                               const LatticeStencil s = lattice.StencilOf(step.middle);
                               for (const int node : s.node)
                                 if (sum.fluence[node] == 0) touched.push_back(node);
                               sum.Add(s, track / media.index2[l], step.is_reduced ? media.scattering[l] * track : 0.0);
                             });
      if (r + 1 < rays.rays.size() && rays.rays[r + 1].piece == piece) continue;
      pieces_.push_back({piece, entries_.size(), touched.size()});
      for (const int node : touched) {
        entries_.push_back({node, static_cast<float>(sum.source[node]), static_cast<float>(sum.fluence[node])});
        sum.source[node] = sum.fluence[node] = 0.0;
      }
      touched.clear();
    }
  }
  bool is_empty() const { return pieces_.empty(); }
  /// Adds sources, or fluences times volume.
  void AddSources(std::span<const double> of_pieces, std::span<double> nodes) const {
    Add(of_pieces, nodes, &Entry::source);
  }
  void AddFluences(std::span<const double> of_pieces, std::span<double> nodes) const {
    Add(of_pieces, nodes, &Entry::fluence);
  }

 private:
  struct Entry {
    int node;
    float source, fluence;
  };
  struct OfPiece {
    int piece;
    size_t first, count;
  };
  void Add(std::span<const double> of_pieces, std::span<double> nodes, float Entry::*what) const {
    for (const OfPiece& p : pieces_)
      for (size_t i = p.first; i < p.first + p.count; ++i)
        nodes[entries_[i].node] += of_pieces[p.piece] * entries_[i].*what;
  }
  std::vector<OfPiece> pieces_;
  std::vector<Entry> entries_;
};

}  // namespace crownfit
