#pragma once
// The crown below a point as flat diffusing layers: how much of a beam leaves them on either side, per spatial
// frequency. Coupled diffusion in every layer (Kienle et al. 1998; Liemert and Kienle 2010), solved layer by layer as
// impedances. These stay finite at any thickness, absorption and frequency.

#include <cmath>
#include <numbers>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {

template <class T>
struct DiffusingLayer {
  T reduced_scattering, absorption, g, ior;
};

/// The inner layer, between two outer layers of equal thickness where there is an outer layer: a crown in transmission.
template <class T>
struct DiffusingStack {
  bool has_outer = false;
  DiffusingLayer<T> outer, inner;
  WetSurface<T> boundary;  ///< between the outermost layer and the medium outside

  /// Refracted cosine of the beam that represents all light. It arrives at 45 degrees, between the viewing direction
  /// and grazing, as lamps do and as diffuse light does in the mean. At normal incidence slabs return 2 to 8 % less.
  T BeamCosine(const DiffusingLayer<T>& layer) const {
    return Terms<T>::RefractedCosine(T(std::numbers::sqrt2 / 2), layer.ior / boundary.outside_ior);
  }
};

/// One layer at one thickness and spatial frequency, independent of its surroundings.
template <class T>
struct LayerResponse {
  T admittance;  ///< D k of the layer; k^2 = absorption / D + q^2
  T once;        ///< exp(-k d)
  T near, far;   ///< light scattered from a unit beam, weighted with exp(-k depth), and with exp(-k (d - depth))
  T beam;        ///< share of the beam that the layer transmits

  /// Lateral diffusion in a clear layer is limited by the layer's thickness rather than by its mean free path: 1 /
  /// D_lateral^2 = 1 / D^2 + (3 c / d)^2, c = 0.6 from random walks in slabs (docs/forward_model.md). Totals do not
  /// depend on it.
  static constexpr double kLateralLimit = 0.6;

  LayerResponse(const DiffusingLayer<T>& layer, const T& beam_cosine, double thickness_mm, double frequency_per_mm) {
    using std::exp;
    using std::sqrt;
    using Term = Terms<T>;
    const double d = thickness_mm, q2 = frequency_per_mm * frequency_per_mm;
    const T scattering = layer.reduced_scattering / beam_cosine,
            extinction = scattering + layer.absorption / beam_cosine;
    // Floors far below relevant values: without scattering there is no diffusion, without loss no derivative.
    const T diffusion =
        Term::DiffusionCoefficient(Term::max(layer.reduced_scattering, T(1e-6)), layer.absorption, layer.g);
    const T loss = Term::max(layer.absorption, T(1e-8)) / diffusion;
    const T limit = 3.0 * kLateralLimit / (d > 0 ? d : 1.0) * diffusion;
    const T k = sqrt(loss + q2 / sqrt(1.0 + limit * limit));
    admittance = diffusion * k;
    once = exp(-k * d);
    near = scattering * d * Term::ExpRatio((extinction + k) * d);
    far = scattering * d * Term::DecayBetween(extinction, k, T(d));
    beam = Term::Attenuation(extinction, T(d));
  }
};

/// A refractive-index step between two diffusing media, crossed from one into the other (Faris 2002, by diffuse
/// moments).
template <class T>
struct IndexStep {
  T scale = T(1.0), offset = T(0.0);
  IndexStep() = default;
  IndexStep(const T& from, const T& into) {
    if (from == into) return;
    const bool denser = into > from;
    const FresnelMoments<T> m = MomentsOf(denser ? T(into / from) : T(from / into));
    const T ahead = denser ? m.diffuse_inside : m.diffuse_outside,
            behind = denser ? m.diffuse_outside : m.diffuse_inside;
    scale = into * into / (from * from);
    offset = 2.0 * (ahead + behind) / (1.0 - ahead);
  }
};

/// One side of a plane in the stack: fluence = impedance x flux into that side + source.
template <class T>
struct Impedance {
  T impedance, source;

  void Cross(const IndexStep<T>& step) {
    impedance = step.scale * impedance + step.offset;
    source = step.scale * source;
  }
  /// `beam`: light that enters the layer on its lit side; `towards_light`: whether the plane moves to that side.
  void Cross(const LayerResponse<T>& layer, const T& beam, bool towards_light) {
    const T zy = impedance * layer.admittance, turned = (zy - 1.0) / (zy + 1.0), there = turned * layer.once,
            both_ways = there * layer.once, amplitude = 1.0 / (1.0 - both_ways);
    const T scattered = towards_light ? layer.near + there * layer.far : layer.far + there * layer.near;
    source = amplitude * (source * (1.0 - turned) * layer.once + beam * scattered / layer.admittance);
    impedance = (1.0 + both_ways) * amplitude / layer.admittance;
  }
};

/// Fourier transforms of a stack's reflectance and transmittance profiles; at frequency 0 their totals.
template <class T>
class StackTransform {
 public:
  struct Totals {
    T reflected, transmitted;  ///< without unscattered light
  };

  explicit StackTransform(const DiffusingStack<T>& stack) : top_(2.0 * MomentsOf(stack.boundary).boundary_A) {
    if (!stack.has_outer) return;
    in_ = IndexStep<T>(stack.outer.ior, stack.inner.ior);
    out_ = IndexStep<T>(stack.inner.ior, stack.outer.ior);
  }

  Totals At(const LayerResponse<T>* outer, const LayerResponse<T>& inner) const {
    const T inner_beam = outer ? outer->beam : T(1.0), back_beam = inner_beam * inner.beam;
    Impedance<T> below{top_, T(0.0)}, above{top_, T(0.0)};
    if (outer) {
      below.Cross(*outer, back_beam, true);
      below.Cross(in_);
      above.Cross(*outer, T(1.0), false);
      above.Cross(in_);
    }
    below.Cross(inner, inner_beam, true);
    above.Cross(inner, inner_beam, false);
    if (outer) {
      below.Cross(out_);
      below.Cross(*outer, T(1.0), true);
      above.Cross(out_);
      above.Cross(*outer, back_beam, false);
    }
    return {below.source / (top_ + below.impedance), above.source / (top_ + above.impedance)};
  }

 private:
  T top_;
  IndexStep<T> in_, out_;
};

}  // namespace crownfit
