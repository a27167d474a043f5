#include "walk/light_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "optics/fresnel_moments.h"
#include "walk/light_rays.h"

namespace crownfit {
namespace {

/// One channel's coefficients, as the diffusion equation has them. Per layer.
struct DiffusingMedia {
  std::vector<double> scattering, absorption, index2, conduction, sink;  ///< reduced; (n / n outside)^2; n^2 D; n^2 sa
  std::vector<const AbsorptionTexture*> texture;
  std::vector<double> leak;         ///< per boundary piece
  std::vector<double> leak_by_cut;  ///< per boundary piece, by ln of what the neck's cut returns; empty: none
  int channel;

  double extinction(size_t l) const { return scattering[l] + absorption[l]; }
};

/// Passed light's moments over the hemisphere inside, of the flux int (1 - F) mu dmu and of int (1 - F) mu^2 dmu: what
/// the boundary's A = (1 + 3 C2) / (1 - 2 C1) is made of. By quadrature; of rough surfaces, whose walk between facets
/// has no closed form, by stratified samples of it (0.3 %).
struct PassedMoments {
  double first = 0, second = 0;
  /// J = n^2 psi / (2 A), over psi.
  double Leak(double index2) const { return index2 * first / (2.0 - 3.0 * second); }
};

PassedMoments PassedBy(const OuterBoundary& b) {
  PassedMoments m;
  if (b.is_smooth() && b.inside_ior >= b.outside_ior) {
    const double n = b.inside_ior / b.outside_ior;
    const WetSurface<double> surface{n, b.wetness, b.outside_ior, b.wetness > 0};
    const Quadrature& q = UnitIntervalQuadrature();
    for (size_t i = 0; i < q.node.size(); ++i) {
      const double root = q.node[i], outside = root * root;
      const double inside = std::sqrt(1.0 - (1.0 - outside * outside) / (n * n));
      const double passed = 2.0 * q.weight[i] * root * outside * (1.0 - surface.Reflectance(outside)) / (n * n);
      m.first += passed;
      m.second += passed * inside;
    }
    return m;
  }
  constexpr int kSamples = 1 << 16;
  RandomStream random(0x626f756e64ull);
  for (int i = 0; i < kSamples; ++i) {
    const double cosine = (i + random.Next()) / kSamples;
    const glm::dvec3 direction(std::sqrt(1.0 - cosine * cosine), 0.0, cosine);
    const bool passes = b.Scatter(direction, {0, 0, 1}, random, {}, {}).direction.z > 0;
    if (!passes) continue;
    m.first += cosine / kSamples;
    m.second += cosine * cosine / kSamples;
  }
  return m;
}

DiffusingMedia MediaOfChannel(const Studio& studio, const VolumeLattice& lattice,
                              const std::vector<PassedMoments>& passed, int channel) {
  constexpr double kFarthest = 1e3;  // mm: transport mean free path of what hardly takes light
  DiffusingMedia m;
  m.channel = channel;
  const double outside = studio.media[kOutside].ior;
  for (size_t i = 1; i < studio.media.size(); ++i) {
    const Medium& medium = studio.media[static_cast<int>(i)];
    const double n2 = medium.ior * medium.ior / (outside * outside);
    m.scattering.push_back(medium.scattering[channel] * (1.0 - (1.0 - medium.isotropic_fraction) * medium.g));
    m.absorption.push_back(medium.absorption[channel]);
    m.index2.push_back(n2);
    m.conduction.push_back(n2 / (3.0 * std::max(m.extinction(i - 1), 1.0 / kFarthest)));
    m.sink.push_back(n2 * medium.absorption[channel]);
    m.texture.push_back(medium.texture);
  }
  // n^2 (1 - rho) / (2 (1 + rho)) of a Lambertian return rho.
  const auto of_return = [](double n2, double rho) { return 0.5 * n2 * (1.0 - rho) / (1.0 + rho); };
  const bool cut_follows = studio.cut_is_opaque && studio.cut_reflectance != glm::dvec3(0.0);
  for (const BoundaryPiece& piece : lattice.pieces()) {
    const double n2 = m.index2[piece.layer];
    const bool is_cut = piece.is_cut && studio.cut_is_opaque;
    const double rho = studio.cut_reflectance[channel];
    m.leak.push_back(is_cut ? of_return(n2, rho)
                     : studio.contact && studio.contact->Holds(piece.position)
                         ? of_return(n2, studio.contact->reflectance[channel])
                         : passed[piece.layer].Leak(n2));
    if (cut_follows) m.leak_by_cut.push_back(is_cut ? -n2 * rho / ((1.0 + rho) * (1.0 + rho)) : 0.0);
  }
  return m;
}

/// By ln reduced scattering and ln absorption of every layer.
struct ByCoefficient {
  std::vector<double> scattering, absorption;
};

/// What rays leave at the nodes, one channel: the fluence over n^2, times volume, of light that was not handed over to
/// diffusion or has just been; and the source of diffuse light. With derivatives.
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
  };
  Nodes value;
  std::vector<Nodes> by;  ///< by scattering and by absorption, layer by layer; none
  Deposits(size_t layers, size_t nodes, bool slopes) : value(nodes), by(slopes ? 2 * layers : 0, Nodes(nodes)) {}
};

/// (1 - exp(-s d)) / s, and its derivative by s.
std::pair<double, double> MeanOverStep(double s, double d) {
  const double x = s * d;
  if (x < 1e-3) return {d * (1.0 - x * (0.5 - x / 6.0)), -d * d * (0.5 - x / 3.0)};
  const double e = std::exp(-x), mean = (1.0 - e) / s;
  return {mean, (d * e - mean) / s};
}

/// Follows rays through one channel's media.
class RayFollower {
 public:
  RayFollower(const DiffusingMedia& media, const Media& walked, const VolumeLattice& lattice, const LightRays& rays)
      : media_(media), walked_(walked), lattice_(lattice), rays_(rays) {
    for (int h = 0; h < kChannels; ++h)
      for (size_t l = 0; l < layers(); ++l) {
        const double s = walked[static_cast<int>(l + 1)].scattering[h];
        true_scattering_[h].push_back(s);
        log_scattering_[h].push_back(s > 0 ? std::log(s) : 0.0);
      }
  }

  size_t layers() const { return media_.scattering.size(); }

  /// Calls visit(step, power x path within the step, its derivatives) along a ray that begins with `power`.
  template <bool kSlopes, class Visit>
  void Follow(const LightRay& ray, double power, const Visit& visit) {
    flown_.assign(layers(), 0.0), reduced_ = collisions_ = flown_;
    by_.scattering.resize(layers()), by_.absorption.resize(layers());
    double left = power;
    std::vector<double> absorbed(layers(), 0.0);
    for (size_t i = ray.first_step; i < ray.first_step + ray.steps; ++i) {
      const LightStep& step = rays_.steps[i];
      const size_t l = step.medium - 1;
      const double factor =
          media_.texture[l] ? media_.texture[l]->At(lattice_.PositionOf(step.middle))[media_.channel] : 1.0;
      const double absorption = factor * media_.absorption[l], d = step.length_mm;
      const double scattering = step.is_reduced ? media_.scattering[l] : 0.0, extinction = absorption + scattering;
      if (!step.is_reduced) flown_[l] += 0.5 * d;
      const auto [mean, mean_by] = MeanOverStep(extinction, d);
      const double arrives = left * step.carried[media_.channel] * Chance(), track = arrives * mean;
      for (size_t k = 0; kSlopes && k < layers(); ++k) {
        by_.scattering[k] = track * (collisions_[k] - true_scattering_[media_.channel][k] * flown_[k] -
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
  /// Of the way so far in this channel, over that for a random hero.
  double Chance() const {
    if (walked_.heroes() == 1) return 1.0;
    std::array<double, kChannels> log_chance{};
    for (int h = 0; h < kChannels; ++h)
      for (size_t l = 0; l < layers(); ++l)
        log_chance[h] += collisions_[l] * log_scattering_[h][l] - true_scattering_[h][l] * flown_[l];
    double sum = 0;
    for (int h = 0; h < kChannels; ++h) sum += std::exp(log_chance[h] - log_chance[media_.channel]);
    return kChannels / sum;
  }
  const DiffusingMedia& media_;
  const Media& walked_;
  const VolumeLattice& lattice_;
  const LightRays& rays_;
  std::array<std::vector<double>, kChannels> true_scattering_, log_scattering_;
  std::vector<double> flown_, reduced_, collisions_;
  ByCoefficient by_;
};

/// Rays of lamps, or (`of_pieces`: power that leaves each boundary piece) those that come back.
void Deposit(const DiffusingMedia& media, RayFollower& follower, const VolumeLattice& lattice, const LightRays& rays,
             std::span<const double> of_pieces, Deposits& d) {
  const auto follow = [&](const LightRay& ray, double power, const auto& visit) {
    d.by.empty() ? follower.Follow<false>(ray, power, visit) : follower.Follow<true>(ray, power, visit);
  };
  for (const LightRay& ray : rays.rays) {
    if ((ray.piece >= 0) != !of_pieces.empty()) continue;
    const double power = ray.piece < 0 ? 1.0 : of_pieces[ray.piece];
    if (power == 0) continue;
    follow(ray, power, [&](const LightStep& step, size_t l, double track, const ByCoefficient& by) {
      const LatticeStencil s = lattice.StencilOf(step.middle);
      const double to_source = step.is_reduced ? media.scattering[l] : 0.0, to_fluence = 1.0 / media.index2[l];
      d.value.Add(s, to_fluence * track, to_source * track);
      if (d.by.empty()) return;
      for (size_t k = 0; k < follower.layers(); ++k) {
        const double direct = k == l ? track : 0.0;  // the source has the coefficient itself as a factor
        d.by[2 * k].Add(s, to_fluence * by.scattering[k], to_source * (by.scattering[k] + direct));
        d.by[2 * k + 1].Add(s, to_fluence * by.absorption[k], to_source * by.absorption[k]);
      }
    });
  }
}

/// Rays that come back, as a matrix from what leaves boundary pieces to sources and fluences at nodes.
class Returns {
 public:
  Returns(const DiffusingMedia& media, RayFollower& follower, const VolumeLattice& lattice, const LightRays& rays) {
    for (const LightRay& ray : rays.rays) {
      if (ray.piece < 0) continue;
      const size_t first = entries_.size();
      follower.Follow<false>(ray, 1.0, [&](const LightStep& step, size_t l, double track, const ByCoefficient&) {
        const LatticeStencil s = lattice.StencilOf(step.middle);
        const double to_source = step.is_reduced ? media.scattering[l] : 0.0;
        for (int k = 0; k < 8; ++k) {
          const double here = s.weight[k] * track;
          entries_.push_back(
              {s.node[k], static_cast<float>(here * to_source), static_cast<float>(here / media.index2[l])});
        }
      });
      rays_.push_back({ray.piece, first, entries_.size() - first});
    }
  }
  bool is_empty() const { return rays_.empty(); }
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
  struct Ray {
    int piece;
    size_t first, count;
  };
  void Add(std::span<const double> of_pieces, std::span<double> nodes, float Entry::*what) const {
    for (const Ray& ray : rays_)
      for (size_t i = ray.first; i < ray.first + ray.count; ++i)
        nodes[entries_[i].node] += of_pieces[ray.piece] * entries_[i].*what;
  }
  std::vector<Ray> rays_;
  std::vector<Entry> entries_;
};

/// One channel of one photograph.
class FieldOfChannel {
 public:
  FieldOfChannel(const Studio& studio, const VolumeLattice& lattice, const DiffusingMedia& media,
                 const LatticeSolver& solver, const LightRays& rays)
      : studio_(studio),
        lattice_(lattice),
        media_(media),
        solver_(solver),
        follower_(media, studio.media, lattice, rays),
        returns_(media, follower_, lattice, rays) {
    const size_t layers = media.scattering.size(), nodes = lattice.nodes().count();
    Deposits deposits(layers, nodes, studio.wants_slopes);
    Deposit(media, follower_, lattice, rays, {}, deposits);
    constexpr double kTolerance = 1e-6;
    Solve(deposits.value.source, kTolerance, psi_);
    if (!returns_.is_empty()) Deposit(media, follower_, lattice, rays, Leaving(psi_), deposits);
    AddUnscattered(deposits.value.fluence, psi_, values_);
    for (size_t k = 0; k < deposits.by.size(); ++k) {
      const int l = static_cast<int>(k / 2);
      const bool by_scattering = k % 2 == 0;
      const double coefficient = by_scattering ? media.scattering[l] : media.absorption[l];
      std::vector<double>&b = deposits.by[k].source, &fluence = deposits.by[k].fluence;
      lattice.AddConduction(l, media.conduction[l] * coefficient / std::max(media.extinction(l), 1e-3), psi_, b);
      if (!by_scattering) lattice.AddSink(l, media.channel, -media.sink[l], psi_, b);
      if (l + 1 == static_cast<int>(layers)) AddCutSlope(by_scattering, b);
      std::vector<double> slope, all;
      Solve(b, kTolerance, slope);
      if (!returns_.is_empty()) returns_.AddFluences(Leaving(slope), fluence);
      AddUnscattered(fluence, slope, all);
      slopes_.push_back(std::move(all));
    }
  }

  /// psi / (4 pi) of all light; and its derivatives: by scattering and by absorption, layer by layer.
  const std::vector<double>& values() const { return values_; }
  const std::vector<std::vector<double>>& slopes() const { return slopes_; }

 private:
  /// Power that leaves each boundary piece as diffuse light.
  std::vector<double> Leaving(const std::vector<double>& psi) const {
    std::vector<double> power;
    for (size_t p = 0; p < lattice_.pieces().size(); ++p) {
      const BoundaryPiece& piece = lattice_.pieces()[p];
      double there = 0;
      for (int k = 0; k < 8; ++k) there += piece.stencil.weight[k] * psi[piece.stencil.node[k]];
      power.push_back(piece.area_mm2 * media_.leak[p] * there);
    }
    return power;
  }

  /// With what comes back: again and again, until it is little.
  void Solve(const std::vector<double>& source, double tolerance, std::vector<double>& psi) const {
    constexpr int kMostReturns = 60;
    psi.assign(source.size(), 0.0);
    if (returns_.is_empty()) {
      solver_.Solve(source, psi, tolerance);
      return;
    }
    std::vector<double> before(source.size(), 0.0);
    for (int i = 0; i < kMostReturns; ++i) {
      std::vector<double> all = source;
      if (i > 0) returns_.AddSources(Leaving(psi), all);
      double change = 0, size = 0;
      for (size_t k = 0; k < all.size(); ++k) change += std::abs(all[k] - before[k]), size += std::abs(all[k]);
      if (change <= 10.0 * tolerance * size) break;
      solver_.Solve(all, psi, tolerance);
      before = std::move(all);
    }
  }

  /// Diffuse and unscattered light together, as radiance.
  void AddUnscattered(const std::vector<double>& fluence, const std::vector<double>& psi,
                      std::vector<double>& radiance) const {
    constexpr double kSliver = 1e-6;  // of an element
    const double least = kSliver * std::pow(lattice_.element_mm(), 3.0);
    radiance.resize(psi.size());
    for (size_t i = 0; i < psi.size(); ++i) {
      const double volume = lattice_.volume_mm3(static_cast<int>(i));
      radiance[i] = (psi[i] + (volume > least ? fluence[i] / volume : 0.0)) / (4.0 * std::numbers::pi);
    }
  }

  void AddCutSlope(bool by_scattering, std::vector<double>& b) const {
    if (media_.leak_by_cut.empty()) return;
    const double slope =
        (by_scattering ? studio_.cut_slopes.scattering : studio_.cut_slopes.absorption)[media_.channel];
    for (size_t p = 0; p < lattice_.pieces().size(); ++p) {
      if (media_.leak_by_cut[p] == 0) continue;
      const BoundaryPiece& piece = lattice_.pieces()[p];
      double there = 0;
      for (int k = 0; k < 8; ++k) there += piece.stencil.weight[k] * psi_[piece.stencil.node[k]];
      for (int k = 0; k < 8; ++k)
        b[piece.stencil.node[k]] -= slope * media_.leak_by_cut[p] * piece.area_mm2 * piece.stencil.weight[k] * there;
    }
  }

  const Studio& studio_;
  const VolumeLattice& lattice_;
  const DiffusingMedia& media_;
  const LatticeSolver& solver_;
  RayFollower follower_;
  Returns returns_;
  std::vector<double> psi_, values_;
  std::vector<std::vector<double>> slopes_;
};

}  // namespace

LightFields::LightFields(const Studio& studio, const VolumeLattice& lattice, const Lighting& lit, uint64_t seed,
                         int threads)
    : lattice_(&lattice) {
  const size_t photographs = studio.specular_factor.size(), layers = studio.media.size() - 1;
  kinds_ = 1 + (studio.wants_slopes ? 2 * layers : 0);
  fields_.assign(photographs * kinds_, std::vector<glm::vec3>(lattice.nodes().count()));
  std::vector<PassedMoments> passed;
  for (size_t l = 0; l < layers; ++l) passed.push_back(PassedBy(studio.outer[l + 1]));
  std::vector<DiffusingMedia> media;
  for (int c = 0; c < kChannels; ++c) media.push_back(MediaOfChannel(studio, lattice, passed, c));
  std::vector<std::optional<LatticeSolver>> solvers(kChannels);
  constexpr size_t kParts = 8;  // fixed, so that sums do not depend on the number of threads
  std::vector<LightRays> parts(photographs * kParts), rays(photographs);
  ParallelFor(kChannels + parts.size(), threads, [&](size_t i) {
    if (i < kChannels) {
      const DiffusingMedia& m = media[i];
      solvers[i].emplace(lattice.nodes(), lattice.Matrix(m.conduction, m.sink, m.leak, static_cast<int>(i)));
    } else {
      const size_t k = i - kChannels;
      parts[k] = TraceLight(studio, lattice, k / kParts, lit, seed, k % kParts, kParts);
    }
  });
  for (size_t k = 0; k < parts.size(); ++k) rays[k / kParts].Append(std::move(parts[k]));
  ParallelFor(photographs * kChannels, threads, [&](size_t i) {
    const size_t p = i / kChannels, c = i % kChannels;
    const FieldOfChannel found(studio, lattice, media[c], *solvers[c], rays[p]);
    for (size_t k = 0; k < kinds_; ++k) {
      const std::vector<double>& from = k == 0 ? found.values() : found.slopes()[k - 1];
      for (size_t n = 0; n < from.size(); ++n)
        fields_[p * kinds_ + k][n][static_cast<int>(c)] = static_cast<float>(from[n]);
    }
  });
}

}  // namespace crownfit
