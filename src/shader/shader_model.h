#pragma once
// The `shader` model: surface reflection + first-order scattering in the outer layer + diffusion in both layers, on
// this side and through from the other. Geometry comes from ray casts (PhotographCast). The material enters here,
// through the shared terms, in any number type. docs/forward_model.md derives the model and lists its omissions.

#include <algorithm>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "capture/polarisation.h"
#include "optics/shading_terms.h"
#include "scene/cast_samples.h"
#include "shader/diffuser_table.h"

namespace crownfit {

/// The material values that the model uses, for one channel. Without an outer layer the diffuser is the whole object.
template <class T>
struct ShaderOptics {
  bool has_outer = false;
  T outer_scattering, outer_absorption, outer_thickness_scale, outer_ior, outer_g;  ///< reduced scattering
  T diffuser_scattering, diffuser_absorption, diffuser_thickness_scale, diffuser_ior, diffuser_g;
  T roughness, wetness, neck_return;
  bool may_be_wet = false;  ///< wet, or wetness is fitted
  double outside_ior = 1.0;

  T entry_ior() const { return (has_outer ? outer_ior : diffuser_ior) / outside_ior; }
  WetSurface<T> surface() const { return {entry_ior(), wetness, outside_ior, may_be_wet}; }
  /// Factor on the outer layer's reduced scattering for first-order light: 1 / (1 - g) turns it into true scattering.
  T FirstOrderFactor(const Polarisers& polarisers) const {
    return polarisers.OfScattered(1.0 / Terms<T>::max(1.0 - outer_g, T(1e-3)));
  }
  /// `factor`: the texture's factor on the layer's absorption.
  T outer_extinction(double factor) const { return outer_scattering + factor * outer_absorption; }
  DiffusingStack<T> stack() const {
    return {has_outer,
            {outer_scattering, outer_absorption, outer_g, outer_ior},
            {diffuser_scattering, diffuser_absorption, diffuser_g, diffuser_ior},
            surface()};
  }
};

/// Light summed over the taps of one ring around a vertex.
template <class Number>
struct RingSum {
  Number front{0.0}, opposite{0.0};
  Number front_below_neck{0.0}, opposite_below_neck{0.0};  ///< where an open scan's tooth would continue
};

/// Interpolated vertex value; 0 outside the mesh.
template <class Number>
Number Interpolated(const Interpolation& at, const std::vector<Number>& of_vertices) {
  Number sum(0.0);
  if (at.exists())
    for (int k = 0; k < 3; ++k) sum += static_cast<double>(at.weights[k]) * of_vertices[at.vertices[k]];
  return sum;
}

/// Sums one ring and advances `tap` to the next.
template <class Number>
RingSum<Number> SumOverRing(const Tap*& tap, const Tap* end, int ring, const std::vector<Number>& entering) {
  RingSum<Number> sum;
  for (; tap < end && tap->ring == ring; ++tap) {
    (tap->beyond_neck ? sum.front_below_neck : sum.front) += Interpolated(tap->front, entering);
    (tap->beyond_neck ? sum.opposite_below_neck : sum.opposite) += Interpolated(tap->opposite, entering);
  }
  return sum;
}

/// Light that depends on no fitted parameter, summed around the requested vertices and kept as long as it is unchanged.
/// Where neither an index nor the wetness is fitted, that is all of a fit.
class GatheredLight {
 public:
  void Take(const Crown& crown, const std::vector<double>& entering) {
    if (crown_ == &crown && entering == entering_) return;
    crown_ = &crown;
    entering_ = entering;
    is_summed_.assign(entering.size(), 0);
    sums_.resize(entering.size() * crown.kernel.rings());
  }
  /// Ring by ring. Many threads may call it, but one at a time for a given vertex.
  const RingSum<double>* Around(int vertex) {
    RingSum<double>* sums = &sums_[static_cast<size_t>(vertex) * crown_->kernel.rings()];
    if (!is_summed_[vertex]) {
      const Tap *tap = &crown_->taps[crown_->first_tap[vertex]], *end = &crown_->taps[crown_->first_tap[vertex + 1]];
      for (int ring = 0; ring < crown_->kernel.rings(); ++ring) sums[ring] = SumOverRing(tap, end, ring, entering_);
      is_summed_[vertex] = 1;
    }
    return sums;
  }

 private:
  const Crown* crown_ = nullptr;
  std::vector<double> entering_;
  std::vector<uint8_t> is_summed_;
  std::vector<RingSum<double>> sums_;
};

/// One photograph in one channel. Construction computes the light that enters the diffuser at every vertex, and the
/// light that leaves it at the vertices around the pixels.
template <class T>
class ShaderPrediction {
 public:
  using Term = Terms<T>;

  /// `light_scale`: factor per light of the capture; 0 leaves a light out. `vertices`: those that pixels will need.
  /// `gathered`: cache of an earlier prediction, to save work where the light is the same.
  ShaderPrediction(const Crown& crown, const PhotographCast& cast, const ShaderOptics<T>& optics,
                   const DiffuserTable<T>& table, int channel, std::span<const double> light_scale,
                   std::span<const int> vertices, int threads, GatheredLight* gathered = nullptr)
      : crown_(crown),
        cast_(cast),
        optics_(optics),
        table_(table),
        channel_(channel),
        light_scale_(light_scale),
        surface_(optics.surface()),
        entry_ior_(surface_.relative_ior),
        diffuse_fresnel_(MomentsOf(surface_).diffuse_outside),
        entering_(crown.fine.vertices.size(), T(0.0)),
        leaving_(crown.fine.vertices.size(), T(0.0)),
        first_order_(optics.has_outer ? crown.fine.vertices.size() : 0, T(0.0)) {
    ParallelFor(entering_.size(), threads, [&](size_t v) {
      for (int s = cast_.first_share[v]; s < cast_.first_share[v + 1]; ++s) {
        const LightShare& share = cast_.vertex_shares.each[s];
        const double irradiance = light_scale_[share.light] * cast_.vertex_shares.irradiance.at(s, channel_);
        if (irradiance > 0) entering_[v] += irradiance * (1.0 - surface_.Reflectance(T(share.cos_incidence)));
      }
      if (const double more = MoreOuterAbsorption(v)) entering_[v] *= ThroughTexture(v, more);
    });
    GatheredLight own;
    if (std::none_of(entering_.begin(), entering_.end(), HasDerivative<T>)) {
      std::vector<double> plain(entering_.size());
      std::transform(entering_.begin(), entering_.end(), plain.begin(), PlainValue<T>);
      gathered_ = gathered ? gathered : &own;
      gathered_->Take(crown, plain);
    }
    const std::vector<int> taps_per_ring = TapsPerRing(crown.kernel);
    if (cast_.has_backing) AddLightReturnedByBacking(taps_per_ring, threads);
    ParallelFor(vertices.size(), threads, [&](size_t i) {
      const int v = vertices[i];
      leaving_[v] = Leaving(v, taps_per_ring);
      if (optics_.has_outer) first_order_[v] = FirstOrder(v);
    });
    gathered_ = nullptr;
  }

  /// The same light seen from another position: a cast with the same vertex data. `vertices` must be among those of
  /// `same`.
  ShaderPrediction(const ShaderPrediction& same, const PhotographCast& cast, std::span<const int> vertices, int threads)
      : crown_(same.crown_),
        cast_(cast),
        optics_(same.optics_),
        table_(same.table_),
        channel_(same.channel_),
        light_scale_(same.light_scale_),
        surface_(same.surface_),
        entry_ior_(same.entry_ior_),
        diffuse_fresnel_(same.diffuse_fresnel_),
        leaving_(same.leaving_),
        first_order_(same.first_order_.size(), T(0.0)) {
    ParallelFor(optics_.has_outer ? vertices.size() : 0, threads,
                [&](size_t i) { first_order_[vertices[i]] = FirstOrder(vertices[i]); });
  }

  /// Radiance of each term, before polarisers.
  struct Radiance {
    T diffuse, first_order, gloss;
  };
  Radiance TermsOf(const PixelCast& pixel) const {
    Radiance r{
        Interpolated(pixel.at, leaving_) * Term::ExitLobe(surface_.Reflectance(T(pixel.cos_view)), diffuse_fresnel_),
        T(0.0), Gloss(pixel)};
    if (optics_.has_outer) r.first_order = Interpolated(pixel.at, first_order_);
    return r;
  }

  /// Pixel value at exposure 1: pi times radiance.
  T Pixel(const PixelCast& pixel, const Polarisers& polarisers) const {
    const Radiance r = TermsOf(pixel);
    return std::numbers::pi *
           (r.diffuse + optics_.FirstOrderFactor(polarisers) * r.first_order + polarisers.of_kept * r.gloss);
  }

 private:
  /// Length at the fitted thickness.
  T Now(const OuterLength& length) const { return length.fixed_mm + length.scaled_mm * optics_.outer_thickness_scale; }

  T InnerThickness(const Column& c) const {
    const T between = optics_.has_outer ? c.total_mm - Now(c.front) - Now(c.back) : T(c.total_mm);
    return Term::max(between, T(0.0)) * optics_.diffuser_thickness_scale;
  }
  /// Table position for light on one side of the object ...
  auto PlaceOf(const Column& c) const { return table_.At(Now(c.front), InnerThickness(c)); }
  /// ... and for light through it, where both outer layers weigh alike.
  auto PlaceThrough(const Column& c) const { return table_.At(0.5 * (Now(c.front) + Now(c.back)), InnerThickness(c)); }

  /// By how much the texture raises the outer layer's absorption here over the material's value, as a share.
  double MoreOuterAbsorption(size_t v) const {
    return optics_.has_outer ? crown_.OuterAbsorption(v, channel_) - 1.0 : 0.0;
  }
  /// Share of the light entering or leaving here that the texture's extra absorption transmits.
  T ThroughTexture(size_t v, double more) const {
    return Term::Attenuation(more * optics_.outer_absorption, table_.OuterWay(PlaceOf(crown_.columns[v])));
  }

  /// Adds light that leaves towards the tile behind the object, is reflected and enters again, as between parallel
  /// faces: rho L / (1 - R rho), with rho the tile's reflectance times the share of the sky it fills.
  void AddLightReturnedByBacking(const std::vector<int>& taps_per_ring, int threads) {
    std::vector<T> returned(entering_.size(), T(0.0));
    ParallelFor(entering_.size(), threads, [&](size_t v) {
      const double rho = cast_.backing[v].reflectance[channel_];
      if (rho <= 0) return;
      const T place = table_.TotalReflected(PlaceOf(crown_.columns[v]));
      returned[v] = Leaving(static_cast<int>(v), taps_per_ring) * rho / (1.0 - rho * place);
    });
    for (size_t v = 0; v < returned.size(); ++v) entering_[v] += returned[v];
    gathered_ = nullptr;  // the tile's light depends on the material
  }

  /// Diffusion: entering light blurred by the profile, on this side and through from the other. Radiant exitance.
  T Leaving(int vertex, const std::vector<int>& taps_per_ring) const {
    if (gathered_)
      return Blurred(vertex, taps_per_ring, [sums = gathered_->Around(vertex)](int ring) { return sums[ring]; });
    const Tap *tap = &crown_.taps[crown_.first_tap[vertex]], *end = &crown_.taps[crown_.first_tap[vertex + 1]];
    return Blurred(vertex, taps_per_ring, [&](int ring) { return SumOverRing(tap, end, ring, entering_); });
  }
  template <class SumOfRing>
  T Blurred(int vertex, const std::vector<int>& taps_per_ring, const SumOfRing& sum_of) const {
    const Column& column = crown_.columns[vertex];
    const auto place = PlaceOf(column), through = PlaceThrough(column);
    T sum(0.0);
    for (int ring = 0; ring < crown_.kernel.rings(); ++ring) {
      const auto light = sum_of(ring);
      const T reflected = table_.Reflected(place, ring), transmitted = table_.Transmitted(through, ring);
      T leaves = reflected * light.front + transmitted * light.opposite;
      if (!crown_.cut.triangles.empty())
        leaves += optics_.neck_return * (reflected * light.front_below_neck + transmitted * light.opposite_below_neck);
      sum += leaves / static_cast<double>(taps_per_ring[ring]);
    }
    if (const double more = MoreOuterAbsorption(vertex)) sum *= ThroughTexture(vertex, more);
    return sum;
  }

  /// Hanrahan and Krueger in the similarity-reduced outer layer: ss' with an isotropic phase function, the scattering
  /// that the attenuation by ss' + sa removed from the beam. Radiance from a vertex towards the camera.
  T FirstOrder(int vertex) const {
    const Column& column = crown_.columns[vertex];
    const double cos_view = std::max(1e-3, glm::dot(crown_.fine_vertex_normals[vertex],
                                                    glm::normalize(cast_.camera - crown_.fine.vertices[vertex])));
    const T extinction = optics_.outer_extinction(crown_.OuterAbsorption(vertex, channel_));
    const T albedo = optics_.outer_scattering / Term::max(extinction, T(1e-9));
    const T tau = extinction * Now(column.front);
    const T mu = Term::RefractedCosine(T(cos_view), entry_ior_);
    const T out = 1.0 - surface_.Reflectance(T(cos_view));
    const T phase(0.25 / std::numbers::pi);
    T sum(0.0);
    for (int s = cast_.first_share[vertex]; s < cast_.first_share[vertex + 1]; ++s) {
      const LightShare& share = cast_.vertex_shares.each[s];
      const double irradiance = light_scale_[share.light] * cast_.vertex_shares.irradiance.at(s, channel_);
      if (irradiance <= 0) continue;
      const T mu0 = Term::RefractedCosine(T(share.cos_incidence), entry_ior_);
      const T in = 1.0 - surface_.Reflectance(T(share.cos_incidence));
      sum += irradiance * Term::SingleScatterReflection(albedo, phase, in * out, entry_ior_, tau, mu0, mu);
    }
    return sum;
  }

  T Gloss(const PixelCast& pixel) const {
    T sum(0.0);
    for (int h = pixel.first_highlight; h < pixel.first_highlight + pixel.highlight_count; ++h) {
      const Highlight& light = cast_.highlights.each[h];
      const double irradiance = light_scale_[light.light] * cast_.highlights.irradiance.at(h, channel_);
      if (irradiance <= 0) continue;
      T reflected = Term::SurfaceReflection(T(light.cos_light), T(pixel.cos_view), T(light.cos_half),
                                            T(light.cos_light_half), optics_.roughness, entry_ior_);
      if (optics_.may_be_wet) {
        const T wet = Term::SurfaceReflectionUnderFilm(T(light.cos_light), T(pixel.cos_view), T(light.cos_half),
                                                       T(light.cos_light_half), optics_.roughness, entry_ior_,
                                                       surface_.film_ior());
        reflected += optics_.wetness * (wet - reflected);
      }
      sum += irradiance * reflected;
    }
    if (!optics_.may_be_wet) return sum;
    double mirrored = 0;
    for (int m = pixel.first_mirrored; m < pixel.first_mirrored + pixel.mirrored_count; ++m)
      mirrored += light_scale_[cast_.mirrored[m].light] * cast_.mirrored[m].radiance[channel_];
    return sum + optics_.wetness * mirrored * Term::FresnelReflectance(T(pixel.cos_view), surface_.film_ior());
  }

  const Crown& crown_;
  const PhotographCast& cast_;
  const ShaderOptics<T>& optics_;
  const DiffuserTable<T>& table_;
  int channel_;
  std::span<const double> light_scale_;
  WetSurface<T> surface_;
  T entry_ior_, diffuse_fresnel_;
  std::vector<T> entering_, leaving_, first_order_;
  GatheredLight* gathered_ = nullptr;  ///< of entering_, while it is built, if it has no derivative
};

}  // namespace crownfit
