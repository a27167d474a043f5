#pragma once
// The crown below a point as flat diffusing layers: which share of the light entering there leaves within each ring
// around it, on the same side (reflection) and on the opposite one (transmission), over the layers' thicknesses.
// Coupled diffusion in every layer (Kienle et al. 1998; Liemert and Kienle 2010), solved in the spatial frequency
// domain layer by layer as impedances, which stay finite at any thickness, absorption and frequency.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

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
    const T less = Term::min(k, extinction), more = Term::max(k, extinction);
    far = scattering * d * exp(-less * d) * Term::ExpRatio((more - less) * d);
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

/// What the outer layer scatters once back out of that beam: SingleScatterReflection, all directions together, as a
/// share of the light that entered.
template <class T>
T FirstOrderTotal(const DiffusingStack<T>& stack, double thickness_mm) {
  using Term = Terms<T>;
  const DiffusingLayer<T>& layer = stack.outer;
  const WetSurface<T>& boundary = stack.boundary;
  const T extinction = layer.reduced_scattering + layer.absorption, cosine = stack.BeamCosine(layer);
  const T albedo = layer.reduced_scattering / Term::max(extinction, T(1e-9)), phase(0.25 / std::numbers::pi);
  const auto& q = UnitIntervalQuadrature();
  T sum(0.0);
  for (size_t i = 0; i < q.node.size(); ++i) {
    const T mu = Term::RefractedCosine(T(q.node[i]), boundary.relative_ior);
    sum += 2.0 * std::numbers::pi * q.weight[i] * q.node[i] *
           Term::SingleScatterReflection(albedo, phase, 1.0 - boundary.Reflectance(T(q.node[i])), boundary.relative_ior,
                                         extinction * thickness_mm, cosine, mu);
  }
  return sum;
}

/// Shares of the light that has passed the surface, over both thicknesses, interpolated by cubics between nodes at
/// TableThickness(2 i) of the outer layer and TableThickness(j) of the inner one.
template <class T>
class DiffuserTable {
 public:
  /// `outer_radius_mm`: of every ring but the last, which takes what is left.
  DiffuserTable(const DiffusingStack<T>& stack, const std::vector<double>& outer_radius_mm);

  /// Nodes and weights around two thicknesses; kept so that several rings share the work.
  template <class Weight>
  struct Nodes {
    int first, rows;  ///< node; outer thicknesses
    std::array<Weight, 16> weight;
  };
  /// Where thickness has no derivative, as in most fits, weights are plain numbers: a third of the work.
  using Place =
      std::conditional_t<std::is_same_v<T, double>, std::variant<Nodes<double>>, std::variant<Nodes<double>, Nodes<T>>>;
  Place At(const T& outer_mm, const T& inner_mm) const;

  /// Share that leaves within a ring. Light that the outer layer scatters once on its way back is not in ring 0.
  T Reflected(const Place& p, int ring) const { return Sum(p, ring); }
  T Transmitted(const Place& p, int ring) const { return Sum(p, rings_ + ring); }
  T TotalReflected(const Place& p) const { return Sum(p, 2 * rings_); }
  T TotalTransmitted(const Place& p) const { return Sum(p, 2 * rings_ + 1); }
  /// Mean length of way in the outer layer from entry, or to exit, of the light that is reflected, mm.
  T OuterWay(const Place& p) const { return Sum(p, 2 * rings_ + 2); }

  /// All of it: inner nodes of each outer node, columns in the order above.
  const std::vector<T>& values() const { return values_; }
  int outer_nodes() const { return outer_nodes_; }
  int columns() const { return 2 * rings_ + 3; }

  static constexpr int kOuterNodes = 9, kInnerNodes = 22;  // to 5.4 mm, to 19 mm

 private:
  using Totals = typename StackTransform<T>::Totals;
  /// Of every pair of nodes.
  std::vector<Totals> TotalsAt(const DiffusingStack<T>& stack, double frequency_per_mm) const;
  void AddWindows(const std::vector<Totals>& totals, const std::vector<double>& share_of_ring);
  void AddTotals(const DiffusingStack<T>& stack, const std::vector<Totals>& totals);
  void AddOuterWay(const DiffusingStack<T>& stack, const std::vector<Totals>& totals);
  static double OuterThickness(size_t node) {
    return Terms<double>::TableThickness(2.0 * static_cast<double>(node / kInnerNodes));
  }
  static double InnerThickness(size_t node) {
    return Terms<double>::TableThickness(static_cast<double>(node % kInnerNodes));
  }
  T& Value(size_t node, int column) { return values_[node * columns() + column]; }
  T Sum(const Place& place, int column) const {
    const auto sum = [&](const auto& p) {
      T total(0.0);
      for (int r = 0; r < p.rows; ++r)
        for (int k = 0; k < 4; ++k)
          total +=
              p.weight[4 * r + k] * values_[static_cast<size_t>(p.first + r * kInnerNodes + k) * columns() + column];
      return total;
    };
    return std::visit(sum, place);
  }
  template <class Weight>
  Nodes<Weight> NodesAround(const Weight& outer_mm, const Weight& inner_mm) const;

  int rings_, outer_nodes_;
  std::vector<T> values_;
};

template <class T>
DiffuserTable<T>::DiffuserTable(const DiffusingStack<T>& stack, const std::vector<double>& outer_radius_mm)
    : rings_(static_cast<int>(outer_radius_mm.size()) + 1),
      outer_nodes_(stack.has_outer ? kOuterNodes : 1),
      values_(static_cast<size_t>(outer_nodes_) * kInnerNodes * columns(), T(0.0)) {
  // A ring's window is the difference of two exp(-r^2 / w). The share of a profile within one is the integral of its
  // transform over exp(-x) dx, x = w q^2 / 4; with w = edge^2 e^0.5772 the mean of ln r where it ends is the ring's
  // edge.
  constexpr double kLogStep = 0.5 * std::numbers::ln2, kLowest = 0.15, kHighest = 4.5;
  const double lowest = kLowest / outer_radius_mm.back();
  const int count = static_cast<int>(std::log(kHighest / outer_radius_mm.front() / lowest) / kLogStep) + 2;
  const std::vector<Totals> totals = TotalsAt(stack, 0.0);
  for (int f = -1; f < count; ++f) {  // -1: all below the lowest, as at 0
    const double q = lowest * std::exp((f < 0 ? -0.5 : f) * kLogStep);
    std::vector<double> share;
    for (double edge : outer_radius_mm) {
      const double x = 0.25 * edge * edge * std::exp(std::numbers::egamma) * q * q;
      share.push_back(f < 0 ? -std::expm1(-x) : 2.0 * kLogStep * x * std::exp(-x));
    }
    for (int ring = rings_ - 2; ring > 0; --ring) share[ring] -= share[ring - 1];
    AddWindows(f < 0 ? totals : TotalsAt(stack, q), share);
  }
  AddTotals(stack, totals);
}

template <class T>
auto DiffuserTable<T>::TotalsAt(const DiffusingStack<T>& stack, double frequency_per_mm) const -> std::vector<Totals> {
  const StackTransform<T> transform(stack);
  std::vector<LayerResponse<T>> inner;
  for (int j = 0; j < kInnerNodes; ++j)
    inner.emplace_back(stack.inner, stack.BeamCosine(stack.inner), InnerThickness(j), frequency_per_mm);
  std::vector<Totals> totals;
  for (int i = 0; i < outer_nodes_; ++i) {
    std::optional<LayerResponse<T>> outer;
    if (stack.has_outer)
      outer.emplace(stack.outer, stack.BeamCosine(stack.outer), OuterThickness(i * kInnerNodes), frequency_per_mm);
    for (const LayerResponse<T>& below : inner) totals.push_back(transform.At(outer ? &*outer : nullptr, below));
  }
  return totals;
}

template <class T>
void DiffuserTable<T>::AddWindows(const std::vector<Totals>& totals, const std::vector<double>& share_of_ring) {
  for (size_t node = 0; node < totals.size(); ++node)
    for (int ring = 0; ring + 1 < rings_; ++ring) {
      Value(node, ring) += share_of_ring[ring] * totals[node].reflected;
      Value(node, rings_ + ring) += share_of_ring[ring] * totals[node].transmitted;
    }
}

/// Totals, the last ring, and what is known of light that is scattered once or never.
template <class T>
void DiffuserTable<T>::AddTotals(const DiffusingStack<T>& stack, const std::vector<Totals>& totals) {
  const int last = rings_ - 1;
  for (size_t node = 0; node < totals.size(); ++node) {
    T reflected = totals[node].reflected, transmitted = totals[node].transmitted;
    Value(node, 2 * rings_) = reflected;
    for (int ring = 0; ring < last; ++ring) {
      reflected -= Value(node, ring);
      transmitted -= Value(node, rings_ + ring);
    }
    Value(node, last) = reflected;
    Value(node, rings_ + last) = transmitted;
    const double outer_mm = OuterThickness(node), inner_mm = InnerThickness(node);
    const auto left = [&](const DiffusingLayer<T>& layer, double mm) {
      return Terms<T>::Attenuation(layer.reduced_scattering + layer.absorption, mm / stack.BeamCosine(layer));
    };
    T beam = left(stack.inner, inner_mm);
    if (stack.has_outer) {
      beam *= left(stack.outer, 2.0 * outer_mm);
      Value(node, 0) -= FirstOrderTotal(stack, outer_mm);
    }
    Value(node, rings_) += beam;
    Value(node, 2 * rings_ + 1) = totals[node].transmitted + beam;
  }
  if (stack.has_outer) AddOuterWay(stack, totals);
}

/// From the derivative of the reflectance by the outer layer's absorption.
template <class T>
void DiffuserTable<T>::AddOuterWay(const DiffusingStack<T>& stack, const std::vector<Totals>& totals) {
  DiffusingStack<T> darker = stack;
  const double more = 1e-5;
  darker.outer.absorption += more;
  const std::vector<Totals> less = TotalsAt(darker, 0.0);
  for (size_t node = 0; node < totals.size(); ++node)
    Value(node, 2 * rings_ + 2) =
        0.5 / more * (1.0 - less[node].reflected / Terms<T>::max(totals[node].reflected, T(1e-9)));
}

template <class T>
auto DiffuserTable<T>::At(const T& outer_mm, const T& inner_mm) const -> Place {
  if constexpr (!std::is_same_v<T, double>)
    if (HasDerivative(outer_mm) || HasDerivative(inner_mm)) return NodesAround<T>(outer_mm, inner_mm);
  return NodesAround<double>(PlainValue(outer_mm), PlainValue(inner_mm));
}

/// The four nodes around a place between 0 and `nodes` - 1. Beyond the ends values go on straight: weights of nodes
/// outside go to the two at the end.
template <class Weight>
struct FourNodes {
  int first;
  std::array<Weight, 4> weight;

  FourNodes(const Weight& place, int nodes) {
    using Term = Terms<Weight>;
    const Weight u = Term::clamp(place, Weight(0.0), Weight(nodes - 1.0));
    const int node = std::clamp(static_cast<int>(PlainValue(u)), 0, nodes - 2);
    const Weight f = u - static_cast<double>(node), before = Term::CubicWeight(-1, f), at = Term::CubicWeight(0, f),
                 next = Term::CubicWeight(1, f), after = Term::CubicWeight(2, f);
    first = node - 1;
    weight = {before, at, next, after};
    if (node == 0) {
      first = 0;
      weight = {at + 2.0 * before, next - before, after, Weight(0.0)};
    } else if (node + 2 == nodes) {
      first = node - 2;
      weight = {Weight(0.0), before, at - after, next + 2.0 * after};
    }
  }
};

template <class T>
template <class Weight>
auto DiffuserTable<T>::NodesAround(const Weight& outer_mm, const Weight& inner_mm) const -> Nodes<Weight> {
  const FourNodes<Weight> inner(Terms<Weight>::TablePlace(inner_mm), kInnerNodes);
  Nodes<Weight> p{inner.first, 1, {}};
  if (outer_nodes_ == 1) {
    std::copy(inner.weight.begin(), inner.weight.end(), p.weight.begin());
    return p;
  }
  const FourNodes<Weight> outer(0.5 * Terms<Weight>::TablePlace(outer_mm), kOuterNodes);
  p.first += outer.first * kInnerNodes;
  p.rows = 4;
  for (int r = 0; r < 4; ++r)
    for (int k = 0; k < 4; ++k) p.weight[4 * r + k] = outer.weight[r] * inner.weight[k];
  return p;
}

}  // namespace crownfit
