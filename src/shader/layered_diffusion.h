#pragma once
// The crown below a point as flat diffusing layers: how much of a beam leaves them on either side, per spatial
// frequency. Coupled diffusion in every layer (Kienle et al. 1998; Liemert and Kienle 2010), solved layer by layer as
// impedances, which stay finite at any thickness, absorption and frequency.

#include <cmath>
#include <numbers>

#include "optics/fresnel_moments.h"
#include "optics/shading_terms.h"

namespace crownfit {

template <class T>
struct DiffusingLayer {
  T reduced_scattering, absorption, g, ior;
};

/// The inner layer, between two outer ones of equal thickness where there is an outer layer: a crown seen through.
template <class T>
struct DiffusingStack {
  bool has_outer = false;
  DiffusingLayer<T> outer, inner;
  WetSurface<T> boundary;  ///< between the outermost layer and the medium outside

  /// Of the beam that stands for all light: it comes at 45 degrees, between the eye's line and grazing, as lamps do and
  /// as diffuse light does in the mean. Slabs return 2 to 8 % less of light that falls straight.
  T BeamCosine(const DiffusingLayer<T>& layer) const {
    return Terms<T>::RefractedCosine(T(std::numbers::sqrt2 / 2), layer.ior / boundary.outside_ior);
  }
};

/// One layer at one thickness and spatial frequency, whatever lies around it.
template <class T>
struct LayerResponse {
  T admittance;  ///< D k of the layer; k^2 = absorption / D + q^2
  T once;        ///< exp(-k d)
  T near, far;   ///< what the layer scatters of a beam of 1, weighted with exp(-k depth), and with exp(-k (d - depth))
  T beam;        ///< left of the beam behind the layer

  /// Lateral diffusion in a clear layer is limited by the layer's thickness rather than by its free path:
  /// 1 / D_lateral^2 = 1 / D^2 + (3 c / d)^2, c = 0.6 from walks in slabs (docs/forward_model.md). Totals are not
  /// touched by it.
  static constexpr double kLateralLimit = 0.6;

  LayerResponse(const DiffusingLayer<T>& layer, const T& beam_cosine, double thickness_mm, double frequency_per_mm) {
    using std::exp;
    using std::sqrt;
    using Term = Terms<T>;
    const double d = thickness_mm, q2 = frequency_per_mm * frequency_per_mm;
    const T scattering = layer.reduced_scattering / beam_cosine,
            extinction = scattering + layer.absorption / beam_cosine;
    // Floors far below what matters: without any scattering there is no diffusion, without any loss no slope.
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

/// An index step between two diffusing media, crossed from one into the other (Faris 2002, by diffuse moments).
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

/// What lies on one side of a plane in the stack: fluence = impedance x flux into that side + source.
template <class T>
struct Impedance {
  T impedance, source;

  void Cross(const IndexStep<T>& step) {
    impedance = step.scale * impedance + step.offset;
    source = step.scale * source;
  }
  /// `beam`: what enters the layer on its lit side; `towards_light`: whether the plane moves to that side.
  void Cross(const LayerResponse<T>& layer, const T& beam, bool towards_light) {
    const T zy = impedance * layer.admittance, turned = (zy - 1.0) / (zy + 1.0), there = turned * layer.once,
            both_ways = there * layer.once, amplitude = 1.0 / (1.0 - both_ways);
    const T scattered = towards_light ? layer.near + there * layer.far : layer.far + there * layer.near;
    source = amplitude * (source * (1.0 - turned) * layer.once + beam * scattered / layer.admittance);
    impedance = (1.0 + both_ways) * amplitude / layer.admittance;
  }
};

/// Fourier transforms of a stack's profiles of reflectance and transmittance; their totals at frequency 0.
template <class T>
class StackTransform {
 public:
  struct Totals {
    T reflected, transmitted;  ///< without light that was never scattered
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
