#pragma once
// The share of the light entering at a point that leaves within each ring around it, on the same and on the opposite
// side. Tabulated over the layers' thicknesses: the transforms of layered_diffusion.h, weighted by the rings' windows.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <type_traits>
#include <variant>
#include <vector>

#include "shader/layered_diffusion.h"

namespace crownfit {

/// Light of that beam that the outer layer scatters back out in one event: SingleScatterReflection over all directions,
/// as a share of the light that entered.
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

/// Shares of the light that has passed the surface, tabulated over both thicknesses. Cubics interpolate between nodes
/// at TableThickness(2 i) of the outer layer and TableThickness(j) of the inner one.
template <class T>
class DiffuserTable {
 public:
  /// `outer_radius_mm`: of every ring but the last, which takes the remainder.
  DiffuserTable(const DiffusingStack<T>& stack, const std::vector<double>& outer_radius_mm);

  /// Nodes and weights around two thicknesses; kept so that several rings share the work.
  template <class Weight>
  struct Nodes {
    int first, rows;  ///< first node; number of outer thicknesses
    std::array<Weight, 16> weight;
  };
  /// Where thickness has no derivative, as in most fits, weights are plain numbers: a third of the work.
  using Place =
      std::conditional_t<std::is_same_v<T, double>, std::variant<Nodes<double>>, std::variant<Nodes<double>, Nodes<T>>>;
  Place At(const T& outer_mm, const T& inner_mm) const;

  /// Share that leaves within a ring. Ring 0 excludes light that the outer layer backscatters once.
  T Reflected(const Place& p, int ring) const { return Sum(p, ring); }
  T Transmitted(const Place& p, int ring) const { return Sum(p, rings_ + ring); }
  T TotalReflected(const Place& p) const { return Sum(p, 2 * rings_); }
  T TotalTransmitted(const Place& p) const { return Sum(p, 2 * rings_ + 1); }
  /// Mean path length of the reflected light in the outer layer, from entry or to exit, mm.
  T OuterWay(const Place& p) const { return Terms<T>::max(Sum(p, 2 * rings_ + 2), T(0.0)); }

  /// The whole table: inner nodes of each outer node, columns in the order above.
  const std::vector<T>& values() const { return values_; }
  int outer_nodes() const { return outer_nodes_; }
  int columns() const { return 2 * rings_ + 3; }

  static constexpr int kOuterNodes = 9, kInnerNodes = 22;  // to 5.4 mm, to 19 mm

 private:
  using Totals = typename StackTransform<T>::Totals;
  /// Totals of every pair of nodes.
  std::vector<Totals> TotalsAt(const DiffusingStack<T>& stack, double frequency_per_mm) const;
  void AddWindows(const std::vector<Totals>& totals, const std::vector<double>& share_of_ring);
  void AddTotals(const DiffusingStack<T>& stack, const std::vector<Totals>& totals);
  void AddOuterWay(const DiffusingStack<T>& stack, const std::vector<Totals>& totals);
  static double OuterThickness(size_t node) {
    const size_t row = node / kInnerNodes;
    return Terms<double>::TableThickness(2.0 * static_cast<double>(row));
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
  // transform over exp(-x) dx, x = w q^2 / 4. With w = edge^2 e^0.5772 the mean of ln r where the window ends is the
  // ring's edge.
  constexpr double kLogStep = 0.5 * std::numbers::ln2, kLowest = 0.15, kHighest = 4.5;
  const double lowest = kLowest / outer_radius_mm.back();
  const int count = static_cast<int>(std::log(kHighest / outer_radius_mm.front() / lowest) / kLogStep) + 2;
  const std::vector<Totals> totals = TotalsAt(stack, 0.0);
  for (int f = -1; f < count; ++f) {  // -1: everything below the lowest frequency, as at 0
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

/// Adds the totals, the last ring, and the light that is scattered once or never.
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

/// The mean path follows from the derivative of the reflectance by the outer layer's absorption.
template <class T>
void DiffuserTable<T>::AddOuterWay(const DiffusingStack<T>& stack, const std::vector<Totals>& totals) {
  DiffusingStack<T> darker = stack;
  const double more = 1e-5;
  darker.outer.absorption += more;
  const std::vector<Totals> less = TotalsAt(darker, 0.0);
  constexpr double kNothing = 1e-9;  // share of light that counts as none: a body of zero thickness returns nothing
  for (size_t node = 0; node < totals.size(); ++node)
    Value(node, 2 * rings_ + 2) = PlainValue(totals[node].reflected) > kNothing
                                      ? 0.5 / more * (1.0 - less[node].reflected / totals[node].reflected)
                                      : T(OuterThickness(node));
}

template <class T>
auto DiffuserTable<T>::At(const T& outer_mm, const T& inner_mm) const -> Place {
  if constexpr (!std::is_same_v<T, double>)
    if (HasDerivative(outer_mm) || HasDerivative(inner_mm)) return NodesAround<T>(outer_mm, inner_mm);
  return NodesAround<double>(PlainValue(outer_mm), PlainValue(inner_mm));
}

/// The four nodes around a position between 0 and `nodes` - 1. Beyond the ends the values are extrapolated linearly:
/// weights of nodes outside go to the two at the end.
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
