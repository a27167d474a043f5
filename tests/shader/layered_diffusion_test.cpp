// The flat layers that represent a crown below each point: energy, limits, and their error against exact slabs.

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <cmath>
#include <tuple>

#include "optics/adding_doubling.h"
#include "shader/diffuser_table.h"

namespace crownfit {
namespace {

using D = Terms<double>;
const std::vector<double> kRadii{0.1, 0.21, 0.42, 0.85, 1.7, 3.4};

DiffusingStack<double> Tooth(double outer_scattering, double outer_absorption, double scattering, double absorption) {
  return {true, {outer_scattering, outer_absorption, 0.68, 1.63}, {scattering, absorption, 0.9, 1.54}, {1.63}};
}

DiffusingStack<double> OneLayer(double scattering, double absorption, double ior) {
  DiffusingStack<double> stack;
  stack.inner = {scattering, absorption, 0.9, ior};
  stack.boundary = {ior};
  return stack;
}

StackTransform<double>::Totals TotalsOf(const DiffusingStack<double>& stack, double outer_mm, double inner_mm,
                                        double frequency_per_mm = 0.0) {
  const LayerResponse<double> inner(stack.inner, stack.BeamCosine(stack.inner), inner_mm, frequency_per_mm);
  if (!stack.has_outer) return StackTransform<double>(stack).At(nullptr, inner);
  const LayerResponse<double> outer(stack.outer, stack.BeamCosine(stack.outer), outer_mm, frequency_per_mm);
  return StackTransform<double>(stack).At(&outer, inner);
}

double BeamLeft(const DiffusingLayer<double>& layer, double cosine, double mm) {
  return std::exp(-(layer.reduced_scattering + layer.absorption) * mm / cosine);
}

/// The same by finite volumes: cells of fluence over squared index, joined by resistances.
StackTransform<double>::Totals ByCells(const DiffusingStack<double>& stack, double outer_mm, double inner_mm,
                                       double frequency_per_mm) {
  constexpr int kCells = 2000;
  const std::vector<std::pair<DiffusingLayer<double>, double>> layers{
      {stack.outer, outer_mm}, {stack.inner, inner_mm}, {stack.outer, outer_mm}};
  const double n = stack.outer.ior, m = stack.inner.ior, rarer = std::min(n, m), denser = std::max(n, m);
  const auto moments = MomentsOf(denser / rarer);
  const double seen_from_denser = moments.diffuse_inside, from_rarer = moments.diffuse_outside;
  const double step = 2 * (seen_from_denser + from_rarer) / ((1 - seen_from_denser) * denser * denser);
  const double boundary = 2 * MomentsOf(stack.boundary).boundary_A / (n * n);
  // resistance[i]: between cell i - 1 and cell i, or the outside.
  std::vector<double> resistance{boundary}, loss, source;
  double beam = 1.0;
  for (size_t l = 0; l < layers.size(); ++l) {
    const auto& [layer, mm] = layers[l];
    const double h = mm / kCells, index2 = layer.ior * layer.ior, cosine = stack.BeamCosine(layer);
    const double diffusion = D::DiffusionCoefficient(layer.reduced_scattering, layer.absorption, layer.g);
    const double limit = 3 * LayerResponse<double>::kLateralLimit / mm, lateral = 1 / std::hypot(1 / diffusion, limit);
    const double half_cell = 0.5 * h / (diffusion * index2), s = layer.reduced_scattering / cosine,
                 t = s + layer.absorption / cosine;
    if (l > 0) resistance.back() += step;
    resistance.back() += half_cell;
    for (int i = 0; i < kCells; ++i) {
      loss.push_back(h * index2 * (layer.absorption + lateral * frequency_per_mm * frequency_per_mm));
      source.push_back(s * beam * (1 - std::exp(-t * h)) / t);
      beam *= std::exp(-t * h);
      resistance.push_back(i + 1 < kCells ? 2 * half_cell : half_cell);
    }
  }
  resistance.back() += boundary;
  // Thomas's elimination.
  const size_t count = loss.size();
  std::vector<double> diagonal(count), right = source;
  for (size_t i = 0; i < count; ++i) diagonal[i] = loss[i] + 1 / resistance[i] + 1 / resistance[i + 1];
  for (size_t i = 1; i < count; ++i) {
    const double f = 1 / (resistance[i] * diagonal[i - 1]);
    diagonal[i] -= f / resistance[i];
    right[i] += f * right[i - 1];
  }
  double fluence = right.back() / diagonal.back();
  const double transmitted = fluence / resistance.back();
  for (size_t i = count - 1; i-- > 0;) fluence = (right[i] + fluence / resistance[i + 1]) / diagonal[i];
  return {fluence / resistance.front(), transmitted};
}

TEST(LayeredDiffusion, ImpedancesAgreeWithFiniteVolumes) {
  for (const auto& stack : {Tooth(0.24, 0.02, 2.0, 0.1), Tooth(2.0, 0.05, 0.5, 1.0), Tooth(0.01, 0.5, 5.0, 0.0)})
    for (double frequency : {0.0, 0.5, 4.0}) {
      const auto totals = TotalsOf(stack, 0.7, 2.0, frequency), cells = ByCells(stack, 0.7, 2.0, frequency);
      EXPECT_NEAR(totals.reflected, cells.reflected, 1e-5);
      EXPECT_NEAR(totals.transmitted, cells.transmitted, 1e-5);
    }
}

TEST(LayeredDiffusion, ConservesEnergyWithoutAbsorption) {
  for (double outer_ior : {1.3, 1.54, 1.63, 2.2})
    for (double outer_mm : {0.0, 0.05, 0.7, 5.0})
      for (double inner_mm : {0.0, 0.3, 3.0}) {
        auto stack = Tooth(0.3, 0.0, 2.0, 0.0);
        stack.outer.ior = stack.boundary.relative_ior = outer_ior;
        const double beam = BeamLeft(stack.outer, stack.BeamCosine(stack.outer), 2 * outer_mm) *
                            BeamLeft(stack.inner, stack.BeamCosine(stack.inner), inner_mm);
        const auto totals = TotalsOf(stack, outer_mm, inner_mm);
        // The floor of 1e-8 / mm on absorption absorbs a few millionths of trapped light.
        EXPECT_NEAR(totals.reflected + totals.transmitted + beam, 1.0, 3e-6) << outer_ior << outer_mm << inner_mm;
      }
}

TEST(LayeredDiffusion, SplittingALayerChangesNothing) {
  const DiffusingStack<double> split{true, {2.0, 0.1, 0.9, 1.54}, {2.0, 0.1, 0.9, 1.54}, {1.54}};
  for (double frequency : {0.0, 0.3}) {  // higher ones are limited by the layers' own thickness
    const auto two = TotalsOf(split, 1.5, 4.0, frequency),
               one = TotalsOf(OneLayer(2.0, 0.1, 1.54), 0.0, 7.0, frequency);
    EXPECT_NEAR(two.reflected, one.reflected, frequency > 0 ? 1e-3 : 1e-12);
    EXPECT_NEAR(two.transmitted, one.transmitted, frequency > 0 ? 1e-3 : 1e-12);
  }
}

TEST(LayeredDiffusion, ToothTotalsAreNearAddingDoubling) {
  // Light at 45 degrees lies between straight and diffuse. Diffusion is worst where little comes back.
  struct Case {
    double outer_scattering, outer_absorption, outer_mm, absorption, inner_mm, tolerance;
  };
  for (const Case& c : {Case{2.0, 0.02, 0.7, 0.07, 2.0, 0.02}, Case{0.24, 0.02, 0.7, 0.07, 3.0, 0.02},
                        Case{0.06, 0.02, 0.7, 0.07, 3.0, 0.03}, Case{1.0, 0.05, 1.0, 0.2, 2.0, 0.06},
                        Case{1.0, 0.02, 1.0, 0.07, 0.3, 0.04}, Case{0.24, 0.02, 1.0, 0.6, 3.0, 0.25}}) {
    const auto stack = Tooth(c.outer_scattering, c.outer_absorption, 2.0, c.absorption);
    const auto layer = [](const DiffusingLayer<double>& l, double mm) {
      return SlabLayer{l.ior, l.g, 0.0, l.reduced_scattering / (1 - l.g), l.absorption, mm};
    };
    Slab slab;
    slab.layers = {layer(stack.outer, c.outer_mm), layer(stack.inner, c.inner_mm), layer(stack.outer, c.outer_mm)};
    const SlabAnswer exact = SolveByAddingDoubling(slab, {12});
    const double straight = exact.value.reflectance_collimated / (1 - exact.specular),
                 diffuse = exact.value.reflectance_diffuse / (1 - exact.specular_diffuse);
    const double reflected = TotalsOf(stack, c.outer_mm, c.inner_mm).reflected;
    EXPECT_GT(reflected, straight * (1 - c.tolerance)) << diffuse;
    EXPECT_LT(reflected, diffuse * (1 + c.tolerance)) << straight;
  }
}

TEST(LayeredDiffusion, SharesAreFiniteAndBetweenZeroAndOne) {
  for (double scattering : {1e-3, 1.0, 1e3})
    for (double absorption : {0.0, 0.1, 1e3})
      for (double outer_scattering : {0.0, 0.3, 1e3}) {
        const DiffuserTable<double> table(Tooth(outer_scattering, absorption, scattering, absorption), kRadii);
        for (double outer_mm : {0.0, 0.7, 9.0})
          for (double inner_mm : {0.0, 2.0, 30.0}) {
            const auto place = table.At(outer_mm, inner_mm);
            const double r = table.TotalReflected(place), t = table.TotalTransmitted(place);
            EXPECT_TRUE(r > -1e-3 && t > -1e-3 && r + t < 1.01)
                << scattering << " " << absorption << " " << outer_scattering << " " << r << " " << t;
          }
      }
}

TEST(LayeredDiffusion, PathInAThinOuterLayerIsBounded) {
  for (double absorption : {0.0, 0.1, 10.0})
    for (double outer_scattering : {0.0, 0.3, 10.0}) {
      const DiffuserTable<double> table(Tooth(outer_scattering, absorption, 1.0, absorption), kRadii);
      for (double outer_mm : {0.0, 0.02, 0.7, 9.0})
        for (double inner_mm : {0.0, 0.05, 2.0, 30.0}) {
          const double way = table.OuterWay(table.At(outer_mm, inner_mm));  // mm, there and back alike
          EXPECT_TRUE(way >= 0.0 && way < 8.0 * std::max(outer_mm, 0.1))
              << absorption << " " << outer_scattering << " " << outer_mm << " " << inner_mm << " " << way;
        }
    }
}

TEST(LayeredDiffusion, RingWindowsSumToTheTotals) {
  // The share of a profile within exp(-r^2 / w) is its transform's integral over exp(-x) dx, x = w q^2 / 4, here on a
  // fine even grid. Both thicknesses are nodes of the table.
  const auto stack = Tooth(0.3, 0.02, 2.0, 0.05);
  const double outer_mm = D::TableThickness(8), inner_mm = D::TableThickness(14);
  const DiffuserTable<double> table(stack, kRadii);
  const auto place = table.At(outer_mm, inner_mm);
  double reflected = FirstOrderTotal(stack, outer_mm),
         transmitted = -BeamLeft(stack.outer, stack.BeamCosine(stack.outer), 2 * outer_mm) *
                       BeamLeft(stack.inner, stack.BeamCosine(stack.inner), inner_mm);
  for (int ring = 0; ring < static_cast<int>(kRadii.size()); ++ring) {
    const double w = kRadii[ring] * kRadii[ring] * std::exp(std::numbers::egamma);
    StackTransform<double>::Totals window{0, 0};
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) {
      const double q = 8 / std::sqrt(w) * (i + 0.5) / kSteps,
                   weight = 0.5 * w * q * std::exp(-0.25 * w * q * q) * 8 / (std::sqrt(w) * kSteps);
      const auto totals = TotalsOf(stack, outer_mm, inner_mm, q);
      window.reflected += weight * totals.reflected;
      window.transmitted += weight * totals.transmitted;
    }
    reflected += table.Reflected(place, ring);
    transmitted += table.Transmitted(place, ring);
    EXPECT_NEAR(reflected, window.reflected, 2e-3 * window.reflected + 1e-4) << ring;
    EXPECT_NEAR(transmitted, window.transmitted, 2e-3 * window.transmitted + 1e-4) << ring;
  }
  const auto totals = TotalsOf(stack, outer_mm, inner_mm);
  EXPECT_NEAR(reflected + table.Reflected(place, 6), totals.reflected, 1e-12);
  EXPECT_NEAR(transmitted + table.Transmitted(place, 6), totals.transmitted, 1e-12);
}

TEST(LayeredDiffusion, TableInterpolatesToTwoThousandths) {
  const auto stack = Tooth(0.5, 0.03, 2.0, 0.08);
  const DiffuserTable<double> table(stack, kRadii);
  for (double outer : {0.0, 0.04, 0.25, 0.5, 0.9, 1.4, 2.7})
    for (double inner : {0.0, 0.03, 0.11, 0.4, 0.93, 2.2, 5.1, 11.0}) {
      const auto exact = TotalsOf(stack, outer, inner);
      const double beam = BeamLeft(stack.outer, stack.BeamCosine(stack.outer), 2 * outer) *
                          BeamLeft(stack.inner, stack.BeamCosine(stack.inner), inner);
      const auto place = table.At(outer, inner);
      EXPECT_NEAR(table.TotalReflected(place), exact.reflected, 2e-3) << outer << " " << inner;
      EXPECT_NEAR(table.TotalTransmitted(place), exact.transmitted + beam, 4e-3) << outer << " " << inner;
    }
}

TEST(LayeredDiffusion, DerivativesMatchFiniteDifferences) {
  using Jet = ceres::Jet<double, 7>;
  const std::array<double, 7> at{0.4, 0.03, 1.63, 2.0, 0.08, 1.54, 0.9};
  const auto table_of = [](const auto& x) {
    using T = std::decay_t<decltype(x[0])>;
    const DiffusingStack<T> stack{true, {x[0], x[1], T(0.68), x[2]}, {x[3], x[4], x[6], x[5]}, {x[2]}};
    return DiffuserTable<T>(stack, kRadii);
  };
  std::array<Jet, 7> jets;
  for (int i = 0; i < 7; ++i) jets[i] = Jet(at[i], i);
  const auto with_derivatives = table_of(jets);
  for (int i = 0; i < 7; ++i) {
    const double h = 1e-4 * at[i];
    auto up = at, down = at;
    up[i] += h;
    down[i] -= h;
    const auto above = table_of(up), below = table_of(down);
    for (size_t v = 0; v < above.values().size(); v += 101) {
      const double slope = (above.values()[v] - below.values()[v]) / (2 * h);
      EXPECT_NEAR(with_derivatives.values()[v].v[i], slope, 1e-5 * (1 + std::abs(slope))) << i << " " << v;
    }
  }
}

}  // namespace
}  // namespace crownfit
