#pragma once
// The `shader` model: surface reflection + first-order scattering in the outer layer + diffusion of the layer below
// seen through it + back light by thickness. Geometry comes cast (PhotographCast); the material enters here, through
// the shared terms, in any number type. docs/forward_model.md derives it and says what it leaves out.

#include <numbers>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "geometry/cast_samples.h"
#include "optics/diffuser.h"
#include "optics/shading_terms.h"

namespace crownfit {

/// What the model reads of a material, for one channel. Without an outer layer the diffuser is the whole object.
template <class T>
struct ShaderOptics {
  bool has_outer = false;
  T outer_scattering, outer_absorption, outer_thickness_scale, outer_ior;  ///< reduced scattering
  T diffuser_scattering, diffuser_absorption, diffuser_thickness_scale, diffuser_ior, diffuser_g;
  T roughness, wetness, neck_return;
  bool may_be_wet = false;  ///< wet, or wetness is fitted
  double outside_ior = 1.0;

  T entry_ior() const { return (has_outer ? outer_ior : diffuser_ior) / outside_ior; }
  WetSurface<T> surface() const { return {entry_ior(), wetness, outside_ior, may_be_wet}; }
  /// `factor`: on absorption, of the layer's texture.
  T outer_extinction(double factor) const { return outer_scattering + factor * outer_absorption; }
  /// The boundary that turns diffuse light back is the one to the air: directions that a plane-parallel outer layer
  /// would refract in between are decided by the diffuser's own index (Snell's invariant).
  DiffuserOptics<T> diffuser() const {
    return {diffuser_scattering,
            diffuser_absorption,
            diffuser_g,
            {diffuser_ior / outside_ior, wetness, outside_ior, may_be_wet}};
  }
};

/// One photograph in one channel. Construction computes the light that enters the diffuser at every vertex.
template <class T>
class ShaderPrediction {
 public:
  using Term = Terms<T>;

  /// `light_scale`: factor per light of the capture; 0 leaves a light out.
  ShaderPrediction(const Crown& crown, const PhotographCast& cast, const ShaderOptics<T>& optics,
                   const DiffuserTable<T>& table, int channel, std::span<const double> light_scale, int threads)
      : cast_(cast),
        optics_(optics),
        table_(table),
        channel_(channel),
        light_scale_(light_scale),
        surface_(optics.surface()),
        entry_ior_(surface_.relative_ior),
        diffuse_fresnel_(MomentsOf(surface_).diffuse_outside),
        entering_(crown.fine.vertices.size(), T(0.0)) {
    ParallelFor(entering_.size(), threads, [&](size_t v) {
      const T extinction = optics_.outer_extinction(crown.columns[v].outer_absorption[channel_]);
      for (int s = cast_.first_share[v]; s < cast_.first_share[v + 1]; ++s) {
        const LightShare& share = cast_.vertex_shares[s];
        const double irradiance = light_scale_[share.light] * share.irradiance[channel_];
        if (irradiance > 0) entering_[v] += irradiance * Entering(share, extinction);
      }
    });
    if (cast_.has_backing) AddLightReturnedByBacking(crown, threads);
  }

  /// Pixel value at exposure 1: pi times radiance.
  T Pixel(const PixelCast& pixel, double specular_factor) const {
    return std::numbers::pi * (Diffuse(pixel) + FirstOrder(pixel) + specular_factor * Gloss(pixel));
  }

 private:
  /// Share of the irradiance that passes the surface and the outer layer unscattered (zeroth order).
  T Entering(const LightShare& share, const T& extinction) const {
    const T passed = 1.0 - surface_.Reflectance(T(share.cos_incidence));
    return optics_.has_outer ? passed * ThroughOuter(share.outer_path, extinction) : passed;
  }

  /// Length at the fitted thickness.
  T Now(const OuterLength& length) const { return length.fixed_mm + length.scaled_mm * optics_.outer_thickness_scale; }

  T ThroughOuter(const OuterLength& path, const T& extinction) const {
    return Term::Attenuation(extinction, Now(path));
  }

  T DiffuserThickness(const OuterLength& front, const OuterLength& back, double total_mm) const {
    const T between = optics_.has_outer ? total_mm - Now(front) - Now(back) : T(total_mm);
    return Term::max(between, T(0.0)) * optics_.diffuser_thickness_scale;
  }

  /// Light through the object, back from the tile behind it and in again, as between parallel faces:
  /// T rho / (1 - R rho) with rho the tile's reflectance times the share of the sky it fills.
  void AddLightReturnedByBacking(const Crown& crown, int threads) {
    const std::vector<T> direct = entering_;
    ParallelFor(entering_.size(), threads, [&](size_t v) {
      const double rho = cast_.backing[v].reflectance[channel_];
      const Column& column = crown.columns[v];
      if (rho <= 0 || column.opposite.triangle < 0) return;
      T from_front(0.0);
      for (int k = 0; k < 3; ++k)
        from_front += column.opposite.weights[k] * direct[crown.fine.triangles[column.opposite.triangle][k]];
      const auto place = table_.At(DiffuserThickness(column.front, column.back, column.total_mm));
      T out = table_.TotalTransmitted(place) * from_front;
      if (optics_.has_outer) {
        const T once = ThroughOuter(column.front, optics_.outer_extinction(column.outer_absorption[channel_]));
        out *= once * once;  // out here and in again
      }
      entering_[v] += out * rho / (1.0 - rho * table_.TotalReflected(place));
    });
  }

  T EnteringAt(const Interpolation& at) const {
    T sum(0.0);
    if (!at.exists()) return sum;
    for (int k = 0; k < 3; ++k) sum += static_cast<double>(at.weights[k]) * entering_[at.vertices[k]];
    return sum;
  }

  /// Diffusion: entering light blurred by the profile, on this side and through from the other.
  T Diffuse(const PixelCast& pixel) const {
    const auto place = table_.At(DiffuserThickness(pixel.front, pixel.back, pixel.total_mm));
    T exitance(0.0);
    int ring = -1;
    T reflected(0.0), transmitted(0.0);
    for (int t = pixel.first_tap; t < pixel.first_tap + pixel.tap_count; ++t) {
      const Tap& tap = cast_.taps[t];
      if (tap.ring != ring) {  // taps come ring by ring
        ring = tap.ring;
        const double share = 1.0 / cast_.taps_per_ring[ring];
        reflected = share * table_.Reflected(place, ring);
        transmitted = share * table_.Transmitted(place, ring);
      }
      const T seen = reflected * EnteringAt(tap.front) + transmitted * EnteringAt(tap.opposite);
      exitance += tap.beyond_neck ? optics_.neck_return * seen : seen;
    }
    if (optics_.has_outer)
      exitance *= ThroughOuter(pixel.outer_path, optics_.outer_extinction(pixel.outer_absorption[channel_]));
    return exitance * Term::ExitLobe(surface_.Reflectance(T(pixel.cos_view)), diffuse_fresnel_);
  }

  /// Hanrahan and Krueger in the similarity-reduced outer layer: ss' with an isotropic phase function, which is the
  /// scattering that the attenuation by ss' + sa took out of the beam.
  T FirstOrder(const PixelCast& pixel) const {
    T sum(0.0);
    if (!optics_.has_outer) return sum;
    const T extinction = optics_.outer_extinction(pixel.outer_absorption[channel_]);
    const T albedo = optics_.outer_scattering / Term::max(extinction, T(1e-9));
    const T tau = extinction * Now(pixel.front);
    const T mu = Term::RefractedCosine(T(pixel.cos_view), entry_ior_);
    const T out = 1.0 - surface_.Reflectance(T(pixel.cos_view));
    const T phase(0.25 / std::numbers::pi);
    for (int s = pixel.first_share; s < pixel.first_share + pixel.share_count; ++s) {
      const LightShare& share = cast_.shares[s];
      const double irradiance = light_scale_[share.light] * share.irradiance[channel_];
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
      const Highlight& light = cast_.highlights[h];
      const double irradiance = light_scale_[light.light] * light.irradiance[channel_];
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

  const PhotographCast& cast_;
  const ShaderOptics<T>& optics_;
  const DiffuserTable<T>& table_;
  int channel_;
  std::span<const double> light_scale_;
  WetSurface<T> surface_;
  T entry_ior_, diffuse_fresnel_;
  std::vector<T> entering_;
};

}  // namespace crownfit
