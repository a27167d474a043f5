#include "path/light_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "path/diffuse_boundary.h"
#include "path/light_deposits.h"
#include "path/light_rays.h"

namespace crownfit {
namespace {

DiffusingMedia MediaOfChannel(const PathContext& context, const VolumeLattice& lattice,
                              const std::vector<PassedMoments>& passed, int channel) {
  constexpr double kFarthest = 1e3;  // mm: largest transport mean free path, for almost clear layers
  DiffusingMedia m;
  m.channel = channel;
  const double outside = context.media[kOutside].ior;
  for (size_t i = 1; i < context.media.size(); ++i) {
    const Medium& medium = context.media[static_cast<int>(i)];
    const double n2 = medium.ior * medium.ior / (outside * outside);
    m.scattering.push_back(medium.scattering[channel] * (1.0 - (1.0 - medium.isotropic_fraction) * medium.g));
    m.absorption.push_back(medium.absorption[channel]);
    m.index2.push_back(n2);
    m.conduction.push_back(n2 / (3.0 * std::max(m.extinction(i - 1), 1.0 / kFarthest)));
    m.sink.push_back(n2 * medium.absorption[channel]);
    m.texture.push_back(medium.texture);
  }
  // Leak n^2 (1 - rho) / (2 (1 + rho)) of a boundary with Lambertian reflectance rho.
  const auto of_return = [](double n2, double rho) { return 0.5 * n2 * (1.0 - rho) / (1.0 + rho); };
  const bool cut_follows = context.cut_is_opaque && !context.cut_reflectance.IsZero();
  for (const BoundaryPiece& piece : lattice.pieces()) {
    const double n2 = m.index2[piece.layer];
    const bool is_cut = piece.is_cut && context.cut_is_opaque;
    const double rho = context.cut_reflectance[channel];
    m.leak.push_back(is_cut ? of_return(n2, rho)
                     : context.contact && context.contact->Holds(piece.position)
                         ? of_return(n2, context.contact->reflectance[channel])
                         : passed[piece.layer].Leak(n2));
    if (cut_follows) m.leak_by_cut.push_back(is_cut ? -n2 * rho / ((1.0 + rho) * (1.0 + rho)) : 0.0);
  }
  return m;
}

/// Deposits of light from lamps, and the rays that return from outside.
struct TracedLight {
  std::vector<Deposits> of_lamps;  ///< per channel
  LightRays back;                  ///< per unit of power that leaves
};

/// Traces the light of one photograph.
TracedLight Trace(const PathContext& context, const VolumeLattice& lattice, const std::vector<DiffusingMedia>& media,
                  size_t photograph, const Lighting& lit, uint64_t seed, int threads) {
  // Every part has its own lattices. The number of parts, and so the sums, do not depend on the number of threads.
  constexpr size_t kFewest = 4, kMost = 8, kNodes = 1600000;
  const size_t nodes = lattice.nodes().count();
  std::vector<TracedLight> parts(std::clamp(kNodes / nodes, kFewest, kMost));
  ParallelFor(parts.size(), threads, [&](size_t part) {
    std::vector<Deposits>& of_lamps = parts[part].of_lamps;
    std::vector<RayFollower> followers;
    for (const DiffusingMedia& m : media) {
      of_lamps.emplace_back(m.scattering.size(), nodes, context.wants_derivatives);
      followers.emplace_back(m, context.media, lattice);
    }
    parts[part].back =
        TraceLight(context, lattice, photograph, lit, seed, part, parts.size(), [&](const LightRays& rays) {
          for (size_t c = 0; c < media.size(); ++c) Deposit(media[c], followers[c], lattice, rays, {}, of_lamps[c]);
        });
  });
  TracedLight& all = parts[0];
  ParallelFor(media.size(), threads, [&](size_t c) {
    for (size_t part = 1; part < parts.size(); ++part) all.of_lamps[c].Add(parts[part].of_lamps[c]);
  });
  for (size_t part = 1; part < parts.size(); ++part) all.back.Append(std::move(parts[part].back));
  return std::move(all);
}

/// The field of one channel of one photograph.
class FieldOfChannel {
 public:
  /// `deposits`: of the lamps' rays.
  FieldOfChannel(const PathContext& context, const VolumeLattice& lattice, const DiffusingMedia& media,
                 const LatticeSolver& solver, Deposits deposits, const LightRays& back)
      : context_(context),
        lattice_(lattice),
        media_(media),
        solver_(solver),
        follower_(media, context.media, lattice),
        returns_(media, follower_, lattice, back) {
    const size_t layers = media.scattering.size();
    std::vector<std::vector<double>> psi(1), derivatives(deposits.by.size());
    Solve({deposits.value.source}, psi);
    psi_ = std::move(psi[0]);
    if (!returns_.is_empty()) Deposit(media, follower_, lattice, back, Leaving(psi_), deposits);
    AddUnscattered(deposits.value.fluence, psi_, values_);
    std::vector<std::vector<double>> sources;
    for (size_t k = 0; k < deposits.by.size(); ++k) {
      const int l = static_cast<int>(k / 2);
      const bool by_scattering = k % 2 == 0;
      const double coefficient = by_scattering ? media.scattering[l] : media.absorption[l];
      std::vector<double>& b = sources.emplace_back(std::move(deposits.by[k].source));
      lattice.AddConduction(l, media.conduction[l] * coefficient / std::max(media.extinction(l), 1e-3), psi_, b);
      if (!by_scattering) lattice.AddSink(l, media.channel, -media.sink[l], psi_, b);
      if (l + 1 == static_cast<int>(layers)) AddCutDerivative(by_scattering, b);
    }
    Solve(sources, derivatives);
    for (size_t k = 0; k < derivatives.size(); ++k) {
      std::vector<double>& fluence = deposits.by[k].fluence;
      if (!returns_.is_empty()) returns_.AddFluences(Leaving(derivatives[k]), fluence);
      AddUnscattered(fluence, derivatives[k], derivatives_.emplace_back());
    }
  }

  /// psi / (4 pi) of all light, and its derivatives: by scattering and by absorption, layer by layer.
  const std::vector<double>& values() const { return values_; }
  const std::vector<std::vector<double>>& derivatives() const { return derivatives_; }

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

  /// Solves for psi of every source together with returning light: iterates until the change is small. Each solve is
  /// only as accurate as the last change requires.
  void Solve(const std::vector<std::vector<double>>& sources, std::span<std::vector<double>> psi) const {
    constexpr int kMostReturns = 60;
    constexpr double kTolerance = 1e-6, kSettled = 10.0 * kTolerance, kOfChange = 0.03;
    if (returns_.is_empty()) {
      solver_.Solve(sources, psi, kTolerance);
      return;
    }
    std::vector<std::vector<double>> before;
    for (int i = 0; i < kMostReturns; ++i) {
      std::vector<std::vector<double>> all = sources;
      double largest = i == 0 ? 1.0 : 0.0;
      for (size_t s = 0; i > 0 && s < all.size(); ++s) {
        returns_.AddSources(Leaving(psi[s]), all[s]);
        double change = 0, size = 0;
        for (size_t k = 0; k < all[s].size(); ++k)
          change += std::abs(all[s][k] - before[s][k]), size += std::abs(all[s][k]);
        if (size > 0) largest = std::max(largest, change / size);
      }
      if (largest <= kSettled) break;
      solver_.Solve(all, psi, std::max(kTolerance, kOfChange * largest));
      before = std::move(all);
    }
  }

  /// Diffuse light plus the rays' fluence, as radiance.
  void AddUnscattered(const std::vector<double>& fluence, const std::vector<double>& psi,
                      std::vector<double>& radiance) const {
    constexpr double kSliver = 1e-6;  // of an element's volume
    const double least = kSliver * std::pow(lattice_.element_mm(), 3.0);
    radiance.resize(psi.size());
    for (size_t i = 0; i < psi.size(); ++i) {
      const double volume = lattice_.volume_mm3(static_cast<int>(i));
      radiance[i] = (psi[i] + (volume > least ? fluence[i] / volume : 0.0)) / (4.0 * std::numbers::pi);
    }
  }

  void AddCutDerivative(bool by_scattering, std::vector<double>& b) const {
    if (media_.leak_by_cut.empty()) return;
    const double slope =
        (by_scattering ? context_.cut_derivatives.scattering : context_.cut_derivatives.absorption)[media_.channel];
    for (size_t p = 0; p < lattice_.pieces().size(); ++p) {
      if (media_.leak_by_cut[p] == 0) continue;
      const BoundaryPiece& piece = lattice_.pieces()[p];
      double there = 0;
      for (int k = 0; k < 8; ++k) there += piece.stencil.weight[k] * psi_[piece.stencil.node[k]];
      for (int k = 0; k < 8; ++k)
        b[piece.stencil.node[k]] -= slope * media_.leak_by_cut[p] * piece.area_mm2 * piece.stencil.weight[k] * there;
    }
  }

  const PathContext& context_;
  const VolumeLattice& lattice_;
  const DiffusingMedia& media_;
  const LatticeSolver& solver_;
  RayFollower follower_;
  Returns returns_;
  std::vector<double> psi_, values_;
  std::vector<std::vector<double>> derivatives_;
};

}  // namespace

LightFields::LightFields(const PathContext& context, const VolumeLattice& lattice, const Lighting& lit, uint64_t seed,
                         int threads)
    : lattice_(&lattice) {
  const size_t photographs = context.polarisers.size(), layers = context.media.size() - 1;
  kinds_ = 1 + (context.wants_derivatives ? 2 * layers : 0);
  const int channels = context.media.channels();
  fields_.assign(photographs * kinds_, SpectrumArray<>(lattice.nodes().count(), channels));
  std::vector<PassedMoments> passed;
  for (size_t l = 0; l < layers; ++l) {
    const bool is_open = std::any_of(lattice.pieces().begin(), lattice.pieces().end(),
                                     [&](const BoundaryPiece& p) { return p.layer == static_cast<int>(l); });
    passed.push_back(is_open ? PassedBy(context.outer[l + 1]) : PassedMoments{});
  }
  std::vector<DiffusingMedia> media;
  for (int c = 0; c < channels; ++c) media.push_back(MediaOfChannel(context, lattice, passed, c));
  std::vector<std::optional<LatticeSolver>> solvers(media.size());
  ParallelFor(media.size(), threads, [&](size_t c) {
    const DiffusingMedia& m = media[c];
    solvers[c].emplace(lattice.nodes(), lattice.Matrix(m.conduction, m.sink, m.leak, static_cast<int>(c)));
  });
  constexpr size_t kTogether = 4;  // photographs; their deposits are kept until their fields are solved
  for (size_t first = 0; first < photographs; first += kTogether) {
    std::vector<TracedLight> traced;
    for (size_t p = first; p < std::min(first + kTogether, photographs); ++p)
      traced.push_back(Trace(context, lattice, media, p, lit, seed, threads));
    ParallelFor(traced.size() * media.size(), threads, [&](size_t i) {
      const size_t c = i % media.size(), p = i / media.size();
      TracedLight& light = traced[p];
      const FieldOfChannel found(context, lattice, media[c], *solvers[c], std::move(light.of_lamps[c]), light.back);
      for (size_t k = 0; k < kinds_; ++k) {
        const std::vector<double>& from = k == 0 ? found.values() : found.derivatives()[k - 1];
        for (size_t n = 0; n < from.size(); ++n)
          fields_[(first + p) * kinds_ + k].at(n, static_cast<int>(c)) = static_cast<float>(from[n]);
      }
    });
  }
}

}  // namespace crownfit
