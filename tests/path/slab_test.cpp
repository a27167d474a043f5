// Flat layered samples: adding-doubling against published and converged values and physical laws, and the random walk
// against adding-doubling. `./dev bench slabs` holds both against tables of independent programs; all models of slabs
// against each other: slab_models_test.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "capture/capture.h"
#include "optics/adding_doubling.h"
#include "optics/quadrature.h"
#include "path/slab_lanes.h"
#include "path/slab_walk.h"
#include "support/slabs.h"

namespace crownfit {
namespace {

/// Layer by albedo and optical depth.
SlabLayer Layer(double ior, double albedo, double depth, double g) {
  return {ior, g, 0.0, albedo * depth, (1 - albedo) * depth, 1.0};
}

/// Totals with the first surface's mirror reflection, as adding-doubling programs print them.
struct Totals {
  double UR1, UT1, URU, UTU;
};
Totals Layered(const Slab& slab, int nodes = 24) {
  const SlabAnswer a = SolveByAddingDoubling(slab, {nodes});
  return {a.value.reflectance_collimated + a.specular, a.value.transmittance_collimated,
          a.value.reflectance_diffuse + a.specular_diffuse, a.value.transmittance_diffuse};
}

TEST(Quadrature, IntegratesPolynomialsExactly) {
  for (const int n : {1, 2, 5, 16, 32}) {
    for (const bool radau : {false, true}) {
      const Quadrature q = radau ? GaussRadau(n, 0.0, 1.0) : GaussLegendre(n, 0.0, 1.0);
      for (int power = 0; power <= 2 * n - (radau ? 2 : 1); ++power) {
        double sum = 0;
        for (int i = 0; i < n; ++i) sum += q.weight[i] * std::pow(q.node[i], power);
        EXPECT_NEAR(sum, 1.0 / (power + 1), 1e-12) << n << " nodes, power " << power;
      }
    }
    EXPECT_DOUBLE_EQ(GaussRadau(n, 0.0, 0.7).node.back(), 0.7);
  }
}

TEST(AddingDoubling, AgreesWithPublishedAndConvergedValues) {
  // van de Hulst 1980, iad's tests and a converged program of 36 nodes (1e-6 unless said).
  const struct {
    const char* name;
    Slab slab;
    Totals value;
    double tolerance;
  } cases[] = {
      {"van de Hulst", Of({Layer(1, .9, 2, .75)}), {.09739, .66096, .19109, .50182}, 1e-5},
      {"isotropic", Of({Layer(1, .99, 1, 0)}), {.33292, .65098, .43596, .54435}, 1e-5},
      {"conservative", Of({Layer(1, 1, 1, 0)}), {.34133, .65867, .44659, .55341}, 1e-5},
      {"thick", Of({Layer(1, 1, 10, 0)}), {.85300, .14700, .88325, .11675}, 1e-5},
      {"n 1.5", Of({Layer(1.5, .9, 1, 0)}), {.22199, .50595, .27973, .44119}, 1e-5},
      {"n 1.62", Of({Layer(1.62, .99, 8, 0)}), {.55673, .14825, .58848, .13600}, 1e-5},
      {"g .9", Of({Layer(1.5, .99, 10, .9)}), {.26467, .42903, .31965, .37529}, 2e-5},
      {"L1", Of({Tissue(.05, 6, .96, 1.62, 1), Tissue(.3, 28, .93, 1.54, 3)}), {.20221, .00875, .25441, .00773}, 5e-5},
      {"L2",
       Of({Tissue(.05, 6.6, .68, 1.62, 1), Tissue(.3, 28, .93, 1.54, 2)}),
       {.37054, .02213, .41546, .02031},
       5e-5},
      {"L3",
       Of({Tissue(.01, 6.6, .68, 1.62, 1), Tissue(.05, 28, .93, 1.54, 3)}),
       {.54944, .08982, .58274, .08291},
       5e-5},
      {"L4", Of({Tissue(.02, 2, 0, 1.62, 1), Tissue(.1, 3, 0, 1.54, 3)}), {.49913, .02613, .53556, .02385}, 2e-5},
      {"L6", Of({Tissue(.02, 2, 0, 1, 1), Tissue(.1, 3, 0, 1, 3)}), {.68041, .02530, .73701, .01968}, 2e-5},
  };
  for (const auto& c : cases) {
    const Totals t = Layered(c.slab);
    EXPECT_NEAR(t.UR1, c.value.UR1, c.tolerance) << c.name;
    EXPECT_NEAR(t.UT1, c.value.UT1, c.tolerance) << c.name;
    EXPECT_NEAR(t.URU, c.value.URU, c.tolerance) << c.name;
    EXPECT_NEAR(t.UTU, c.value.UTU, c.tolerance) << c.name;
  }
  // Half-space, n = 1: UR1 = 1 - H(1) sqrt(1 - a) (Chandrasekhar).
  EXPECT_NEAR(Layered(Of({Layer(1, .95, 400, 0)})).UR1, .535541, 2e-6);
}

TEST(AddingDoubling, ConservesEnergyWithoutAbsorption) {
  for (const double g : {0.0, 0.8, 0.96}) {
    Slab slab = Of({Tissue(0, 6, g, 1.62, 1), Tissue(0, 28, g, 1.54, 2)});
    for (const double rho : {0.0, 0.5}) {
      slab.backing_reflectance = rho;
      const Totals t = Layered(slab);
      EXPECT_NEAR(t.UR1 + t.UT1, 1.0, 2e-6) << g;
      EXPECT_NEAR(t.URU + t.UTU, 1.0, 2e-6 + 2e-5) << g;  // the specular part comes from another quadrature
    }
  }
}

TEST(AddingDoubling, WhiteLayersConserveEnergyAndTransmitAsInverseDepth) {
  for (const double g : {0.0, 0.8, 0.999})
    for (const double ior : {1.0, 1.5}) {
      double last = 0;
      for (const double depth : {1.0, 1e3, 1e5, 1e7, 1e9}) {
        Slab slab;
        slab.layers = {{.ior = ior, .g = g, .scattering_per_mm = depth, .absorption_per_mm = 0, .thickness_mm = 1}};
        const SlabAnswer a = SolveByAddingDoubling(slab);
        EXPECT_NEAR(a.specular + a.value.reflectance_collimated + a.value.transmittance_collimated, 1.0, 1e-12);
        EXPECT_NEAR(a.specular_diffuse + a.value.reflectance_diffuse + a.value.transmittance_diffuse, 1.0, 1e-12);
        // Diffusion: T = c / (depth + extrapolation). The relative extrapolation is below 1e-3 from a reduced depth of
        // 1e4 on.
        if (last > 0 && depth * (1 - g) >= 1e6) {
          EXPECT_NEAR(a.value.transmittance_collimated * depth / last, 1.0, 2e-3) << g << " " << ior << " " << depth;
        }
        last = a.value.transmittance_collimated * depth;
      }
    }
}

TEST(AddingDoubling, SplittingALayerOrAddingAClearOneChangesNothing) {
  const SlabLayer a = Tissue(.05, 6, .9, 1.62, 1), b = Tissue(.3, 28, .93, 1.54, 2);
  SlabLayer half = a;
  half.thickness_mm = 0.5;
  const Totals whole = Layered(Of({a, b})), split = Layered(Of({half, half, b})),
               clear = Layered(Of({a, Tissue(0, 0, 0, 1.62, 1), b}));
  for (const Totals& t : {split, clear}) {
    EXPECT_NEAR(t.UR1, whole.UR1, 1e-8);
    EXPECT_NEAR(t.UTU, whole.UTU, 1e-8);
  }
}

/// Layers whose indices differ by a step from each other or from the media above and below.
std::vector<Slab> Stepped(double step, double absorption, double g) {
  const auto tissue = [&](double ior, double mm) { return Tissue(absorption, 2 / (1 - g), g, ior, mm); };
  std::vector<Slab> slabs{Of({tissue(1 + step, 1)}), Of({tissue(1.54, .3), tissue(1.54 + step, 1)}),
                          Of({tissue(1.54 + 2 * step, .3), tissue(1.54, .3), tissue(1.54 + step, 1)}),
                          Of({tissue(1.54, 1)}), Of({tissue(1.54 + step, 1)})};
  slabs[3].ior_below = 1.54 + step;
  slabs[3].backing_reflectance = 0.5;
  slabs[4].ior_above = 1.54;
  return slabs;
}
constexpr double kSteps[] = {0,    1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 1e-11,  1e-10,  1e-9, 2e-9, 1e-8,
                             1e-7, 1e-6,  1e-5,  1e-4,  3e-4,  1e-3,  1.7e-3, 1.8e-3, 2e-3, 1e-2};

TEST(AddingDoubling, IsContinuousWhereIndicesMeet) {
  // A step totally reflects a share of about twice its size, which bounds the change of every answer. Other angles
  // change a sharp phase function by 1e-8. More angles agree as well as they do elsewhere.
  for (const auto& [g, tolerance] : {std::pair{0.0, 1e-9}, {0.8, 5e-8}, {0.96, 4e-5}}) {
    const std::vector<Slab> without = Stepped(0, 0.05, g);
    for (const double step : kSteps) {
      const std::vector<Slab> with = Stepped(step, 0.05, g);
      for (size_t i = 0; i < with.size(); ++i) {
        const Totals t = Layered(with[i]), none = Layered(without[i]), finer = Layered(with[i], 36);
        for (const auto part : {&Totals::UR1, &Totals::UT1, &Totals::URU, &Totals::UTU}) {
          EXPECT_NEAR(t.*part, none.*part, 2 * step + 1e-8) << "slab " << i << ", g " << g << ", step " << step;
          EXPECT_NEAR(t.*part, finer.*part, tolerance) << "slab " << i << ", g " << g << ", step " << step;
        }
        EXPECT_LE(t.UR1 + t.UT1, 1.0);
        EXPECT_LE(t.URU + t.UTU, 1.0);
      }
    }
  }
}

TEST(AddingDoubling, ConservesEnergyWhereIndicesMeet) {
  for (const double g : {0.0, 0.96})
    for (const double step : kSteps)
      for (Slab slab : Stepped(step, 0, g)) {
        slab.backing_reflectance = 0;
        const Totals t = Layered(slab);
        EXPECT_NEAR(t.UR1 + t.UT1, 1.0, 1e-12) << "g " << g << ", step " << step;
        EXPECT_NEAR(t.URU + t.UTU, 1.0, 2e-9) << "g " << g << ", step " << step;
      }
}

TEST(ViewSlab, IsContinuousWhereIndicesMeet) {
  for (const MeasuredAt geometry : {MeasuredAt::k45_0, MeasuredAt::kD_8}) {
    const auto seen = [&](double step) {
      return ViewSlab(Stepped(step, 0.05, 0.8)[1], {{0.3, 1.0}}, geometry, {24})[0];
    };
    for (const double step : kSteps) {
      const ViewedSlab with = seen(step), without = seen(0);
      EXPECT_NEAR(with.mirrored, without.mirrored, 1e-15);
      EXPECT_NEAR(with.reflectance, without.reflectance, step + 1e-8) << step;
      EXPECT_NEAR(with.Over(0.8), without.Over(0.8), step + 1e-8) << step;
    }
  }
}

/// Each parameter of each layer that affects light, in turn.
struct NumberOfLayer {
  size_t layer;
  double SlabLayer::*number;
  double step;  ///< a thousandth of it, or of 0.01
};
std::vector<NumberOfLayer> NumbersOf(const Slab& slab) {
  std::vector<NumberOfLayer> numbers;
  for (size_t l = 0; l < slab.layers.size(); ++l) {
    const SlabLayer& layer = slab.layers[l];
    if (layer.scattering_per_mm + layer.absorption_per_mm == 0) continue;
    for (double SlabLayer::*number :
         {&SlabLayer::scattering_per_mm, &SlabLayer::absorption_per_mm, &SlabLayer::thickness_mm, &SlabLayer::ior})
      numbers.push_back({l, number, 1e-3 * std::max(0.01, layer.*number)});
    for (double SlabLayer::*number : {&SlabLayer::g, &SlabLayer::isotropic_fraction})
      numbers.push_back({l, number, 1e-3});
  }
  return numbers;
}

TEST(ViewSlab, DerivativesMatchFiniteDifferences) {
  Slab contact = Of({{1.63, 0.96, 0, 6, 0.03, 0.6}, {1.54, 0.0, 0.2, 2, 1.5, 1.1}});
  contact.backing_contact = true;
  const Slab slabs[] = {Of({{1.54, 0.8, 0.1, 15, 0.03, 1}}),                                     // ceramic
                        Of({{1.63, 0.9, 0.1, 6, 0.03, 0.6}, {1.54, 0.85, 0.05, 20, 0.1, 1.1}}),  // tooth
                        Of({{1.5, -0.3, 0.1, 0.01, 0.001, 0.1}}),                                // next to nothing
                        Of({{1.5, 0, 0, 0, 0, 1}, {1.54, 0.7, 0.1, 40, 0.01, 5}, {1.5, 0, 0, 0, 0, 1}}),  // slides
                        Of({{1.54, 0.0, 0.0, 0.01, 2, 1}}),  // hardly scatters
                        contact};
  for (const Slab& slab : slabs)
    for (const MeasuredAt geometry : {MeasuredAt::k45_0, MeasuredAt::kD_8, MeasuredAt::k0_D, MeasuredAt::kD_D}) {
      const auto view = [&](Slab there) {
        std::vector<double> mm;
        for (const SlabLayer& layer : there.layers) mm.push_back(layer.thickness_mm);
        return ViewSlab(there, {mm}, geometry)[0];
      };
      std::vector<std::vector<SlabLayer>> changes;
      std::vector<double> mm;
      for (const SlabLayer& layer : slab.layers) mm.push_back(layer.thickness_mm);
      const std::vector<NumberOfLayer> numbers = NumbersOf(slab);
      for (const NumberOfLayer& n : numbers) {
        changes.emplace_back(slab.layers.size(), SlabLayer{0, 0, 0, 0, 0, 0});
        changes.back()[n.layer].*n.number = n.step;
      }
      const ViewedSlab here = view(slab);
      const std::vector<ViewedSlab> found = ViewSlabChanges(slab, {mm}, geometry, changes)[0];
      for (size_t k = 0; k < numbers.size(); ++k) {
        const auto at = [&](double steps) {
          Slab there = slab;
          there.layers[numbers[k].layer].*numbers[k].number += steps * numbers[k].step;
          return view(there);
        };
        const ViewedSlab one = at(1), less = at(-1), two = at(2), two_less = at(-2);
        const auto expect = [&](double ViewedSlab::*seen) {
          // Richardson extrapolation. Viewed along a direction that carries 1e-12 of the light, answers are accurate to
          // about 1e-10.
          const double want = (8 * (one.*seen - less.*seen) - (two.*seen - two_less.*seen)) / 12;
          EXPECT_NEAR(found[k].*seen, want, 1e-6 * std::abs(want) + 1e-9)
              << "layer " << numbers[k].layer << ", number " << k;
        };
        for (double ViewedSlab::*seen : {&ViewedSlab::reflectance, &ViewedSlab::mirrored, &ViewedSlab::transmittance,
                                         &ViewedSlab::emergence, &ViewedSlab::reflectance_below})
          expect(seen);
        EXPECT_NEAR(here.ChangeOver(0.8, found[k]),
                    (8 * (one.Over(0.8) - less.Over(0.8)) - (two.Over(0.8) - two_less.Over(0.8))) / 12,
                    1e-6 * std::abs(here.ChangeOver(0.8, found[k])) + 3e-9);
      }
    }
}

TEST(ViewSlab, DerivativesAreContinuousAtZeroAbsorption) {
  const auto changes = [](double absorption) {
    std::vector<std::vector<SlabLayer>> by(4, {SlabLayer{0, 0, 0, 0, 0, 0}});
    by[0][0].scattering_per_mm = by[1][0].absorption_per_mm = by[2][0].g = by[3][0].thickness_mm = 1;
    return ViewSlabChanges(Of({{1.5, 0.7, 0, 10, absorption, 2}}), {{2.0}}, MeasuredAt::k0_D, by)[0];
  };
  const auto none = changes(0), hardly = changes(1e-8);
  for (size_t k = 0; k < none.size(); ++k) {
    EXPECT_NEAR(none[k].reflectance, hardly[k].reflectance, 1e-5 * std::abs(hardly[k].reflectance) + 1e-7) << k;
    EXPECT_NEAR(none[k].transmittance, hardly[k].transmittance, 1e-5 * std::abs(hardly[k].transmittance) + 1e-7) << k;
    if (k == 1) continue;  // the other parameters cause no loss
    EXPECT_NEAR(none[k].reflectance + none[k].transmittance, 0.0, 1e-7) << k;
  }
}

TEST(ViewSlab, IndexDerivativeIsContinuousAtIndexOne) {
  const std::vector<SlabLayer> change{{1, 0, 0, 0, 0, 0}};
  const auto by_index = [&](double ior) {
    return ViewSlabChanges(Of({{ior, 0.5, 0, 5, 0.1, 1}}), {{1.0}}, MeasuredAt::k0_D, {change})[0][0].transmittance;
  };
  EXPECT_NEAR(by_index(1.0), by_index(1.002), 0.1 * by_index(1.002))
      << "total reflection grows with the root of the step";
}

TEST(AddingDoubling, DiffuseTransmittanceIsTheSameFromBothSides) {
  const SlabLayer a = Tissue(.05, 6, .9, 1.62, 1), b = Tissue(.3, 28, .93, 1.4, 2);
  EXPECT_NEAR(Layered(Of({a, b})).UTU, Layered(Of({b, a})).UTU, 1e-9);
}

TEST(AddingDoubling, PureAbsorberFollowsBeerAndFresnel) {
  EXPECT_NEAR(Layered(Of({Layer(1, 0, 1, 0)})).UT1, std::exp(-1.0), 1e-8);
  EXPECT_NEAR(Layered(Of({Layer(1, 0, 1, 0)})).UTU, .21938393, 1e-6);  // 2 E3(1)
  const double f = std::pow(.62 / 2.62, 2);
  EXPECT_NEAR(Layered(Of({Layer(1.62, 0, 0, 0)})).UR1, 2 * f / (1 + f), 1e-12);
  const double a = std::exp(-0.3);
  EXPECT_NEAR(Layered(Of({Layer(1.62, 0, .3, 0)})).UT1, (1 - f) * (1 - f) * a / (1 - f * f * a * a), 1e-8);
}

TEST(AddingDoubling, NonAbsorbingSlabOnWhiteBackingReturnsEverything) {
  Slab slab = Of({Tissue(0, 5, .8, 1.54, 1)});
  slab.backing_reflectance = 1.0;
  for (const bool contact : {false, true}) {
    slab.backing_contact = contact;
    EXPECT_NEAR(Layered(slab).UR1, 1.0, 1e-6);
    EXPECT_NEAR(Layered(slab).UT1, 0.0, 1e-12);
  }
}

TEST(SlabWalk, AgreesWithAddingDoublingWithinItsStatedErrors) {
  Slab on_white = Of({Tissue(.05, 6.6, .68, 1.62, 1), Tissue(.1, 28, .93, 1.54, 1)}), in_contact = on_white;
  on_white.backing_reflectance = in_contact.backing_reflectance = 0.85;
  in_contact.backing_contact = true;
  Slab mixed = Of({Tissue(.1, 8, .9, 1.5, 1)});
  mixed.layers[0].isotropic_fraction = 0.4;
  Slab matched = Of({Tissue(.03, 6, .96, 1.63, .5), Tissue(.2, 28, .93, 1.63, 1)});
  matched.ior_below = 1.63;
  // Light attenuated to e^-5 and less, where Russian roulette decides; a clear layer between others; backward
  // scattering.
  const Slab dark = Of({Tissue(5, 10, .9, 1.5, 1)}),
             with_clear = Of({Tissue(.1, 6, .9, 1.6, .5), Tissue(.2, 0, 0, 1.4, .5), Tissue(.1, 20, -.4, 1.5, .5)});
  const Slab slabs[] = {
      Of({Layer(1, .9, 2, .75)}), Of({Layer(1.62, .99, 8, 0)}), on_white, in_contact, mixed, matched, dark, with_clear};
  for (size_t i = 0; i < std::size(slabs); ++i) {
    const SlabTotals want = SolveByAddingDoubling(slabs[i]).value;
    const SlabAnswer got = SolveByWalks(slabs[i], {60000, i + 1, 0}, [](double) {});
    const auto agree = [&](double a, double b, double error) {
      EXPECT_NEAR(a, b, 4 * error + 3e-5) << "slab " << i;
      EXPECT_GT(error, 0.0);
    };
    agree(got.value.reflectance_collimated, want.reflectance_collimated, got.stddev.reflectance_collimated);
    agree(got.value.transmittance_collimated, want.transmittance_collimated, got.stddev.transmittance_collimated);
    agree(got.value.reflectance_diffuse, want.reflectance_diffuse, got.stddev.reflectance_diffuse);
    agree(got.value.transmittance_diffuse, want.transmittance_diffuse, got.stddev.transmittance_diffuse);
  }
}

TEST(SlabWalk, StatedErrorsMatchThirtySeedsAndRingsSumToTotals) {
  Slab slab = Of({Tissue(.2, 10, .8, 1.54, 1)});
  slab.radii_mm = {0, 0.2, 0.5, 1, 2, 1000};
  constexpr int kSeeds = 30;
  std::vector<std::vector<double>> values, errors;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const SlabAnswer a = SolveByWalks(slab, {4000, seed, 0}, [](double) {});
    values.push_back({a.value.reflectance_collimated, a.value.transmittance_collimated, a.value.reflectance_diffuse,
                      a.value.transmittance_diffuse});
    errors.push_back({a.stddev.reflectance_collimated, a.stddev.transmittance_collimated, a.stddev.reflectance_diffuse,
                      a.stddev.transmittance_diffuse});
    double rings = 0;
    for (size_t r = 0; r + 1 < slab.radii_mm.size(); ++r) {
      rings += a.radial_reflectance_per_mm2[r] * M_PI *
               (slab.radii_mm[r + 1] * slab.radii_mm[r + 1] - slab.radii_mm[r] * slab.radii_mm[r]);
      values.back().push_back(a.radial_reflectance_per_mm2[r]);
      errors.back().push_back(a.radial_reflectance_stddev[r]);
      values.back().push_back(a.radial_transmittance_per_mm2[r]);
      errors.back().push_back(a.radial_transmittance_stddev[r]);
    }
    EXPECT_NEAR(rings, a.value.reflectance_collimated, 1e-9);
  }
  double ratios = 0;
  const size_t count = values[0].size();
  for (size_t q = 0; q < count; ++q) {
    double sum = 0, square = 0, stated = 0;
    for (int s = 0; s < kSeeds; ++s) {
      sum += values[s][q], square += values[s][q] * values[s][q];
      stated += errors[s][q] * errors[s][q] / kSeeds;
    }
    ratios += (square - sum * sum / kSeeds) / (kSeeds - 1) / stated;
  }
  const double ratio = std::sqrt(ratios / static_cast<double>(count));
  std::printf("scatter over stated error: %.3f\n", ratio);
  EXPECT_GT(ratio, 0.8);
  EXPECT_LT(ratio, 1.25);
}

TEST(SlabWalk, SameAnswerForAnyNumberOfLanes) {
  Slab slab = Of({Tissue(.1, 8, .9, 1.5, .5), Tissue(.2, 20, .8, 1.6, 1)});
  slab.layers[0].isotropic_fraction = 0.3;
  slab.backing_reflectance = 0.6;
  slab.radii_mm = {0, 0.5, 1, 3};
  const auto answer = [&](int lanes) {
    SlabAnswer a = SolveByWalks(slab, {.photons = 3000, .threads = 1, .lanes = lanes}, [](double) {});
    return SlabAnswerJson(a);
  };
  const std::string one = answer(1);
  for (const int lanes : {3, 64, SlabLanes::kMax}) EXPECT_EQ(answer(lanes), one) << lanes;
}

/// All lanes repeatedly fly in one direction and scatter.
TEST(SlabLanes, FlightsAreExponentialAndAnglesHenyeyGreenstein) {
  constexpr int kFlights = 4000;
  constexpr double kDeepest_mm = 1e6, kFreePath_mm = 0.5;
  const glm::dvec3 directions[] = {{0, 0, -1}, {0.6, 0, 0.8}, glm::normalize(glm::dvec3(-3, 2, -1))};
  for (const auto& [g, isotropic] : {std::pair(0.9, 0.0), {0.0, 0.0}, {-0.5, 0.0}, {0.8, 0.4}})
    for (const glm::dvec3& d : directions) {
      SlabLanes lanes{};
      glm::dvec3 mean(0.0);
      double flight = 0, flight2 = 0, forward2 = 0;
      glm::dmat3 second(0.0);
      for (int i = 0; i < SlabLanes::kMax; ++i) {
        const RandomStream random(Key(7, i));
        lanes.Enter(i, {kDeepest_mm, -kDeepest_mm, kFreePath_mm, 0.0, g, isotropic, 1.0, 1.0});
        lanes.random[i] = random.state();
        lanes.random_step[i] = random.step();
      }
      for (int k = 0; k < kFlights; ++k) {
        for (int i = 0; i < SlabLanes::kMax; ++i) {
          lanes.x[i] = lanes.y[i] = lanes.z[i] = 0.0;
          lanes.dx[i] = d.x, lanes.dy[i] = d.y, lanes.dz[i] = d.z;
        }
        lanes.Fly(SlabLanes::kMax);
        for (int i = 0; i < SlabLanes::kMax; ++i) {
          ASSERT_EQ(lanes.fate[i], SlabLanes::kCollided);
          const glm::dvec3 w(lanes.dx[i], lanes.dy[i], lanes.dz[i]), to(lanes.x[i], lanes.y[i], lanes.z[i]);
          ASSERT_NEAR(glm::length(w), 1.0, 1e-14);
          ASSERT_NEAR(glm::length(to - glm::dot(to, d) * d), 0.0, 1e-14);
          mean += w;
          second += glm::outerProduct(w, w);
          forward2 += glm::dot(w, d) * glm::dot(w, d);
          flight += glm::length(to);
          flight2 += glm::dot(to, to);
        }
      }
      constexpr double n = static_cast<double>(kFlights) * SlabLanes::kMax;
      const double tolerance = 4.5 / std::sqrt(n), first = (1 - isotropic) * g,  // Legendre moments: g and g^2
          forward = (1.0 + 2.0 * (1 - isotropic) * g * g) / 3.0, aside = 0.5 * (1.0 - forward);
      EXPECT_NEAR(flight / n, kFreePath_mm, tolerance * kFreePath_mm);
      EXPECT_NEAR(flight2 / n, 2.0 * kFreePath_mm * kFreePath_mm,
                  tolerance * std::sqrt(20.0) * kFreePath_mm * kFreePath_mm);
      EXPECT_NEAR(forward2 / n, forward, tolerance * 0.5);  // no value in [0, 1] scatters by more than 0.5
      const glm::dmat3 want = aside * glm::dmat3(1.0) + (forward - aside) * glm::outerProduct(d, d);
      for (int a = 0; a < 3; ++a) {
        EXPECT_NEAR(mean[a] / n, first * d[a], tolerance);
        for (int b = 0; b < 3; ++b) EXPECT_NEAR(second[a][b] / n, want[a][b], tolerance) << a << b;
      }
    }
}

TEST(SlabWalk, SameAnswerForAnyNumberOfThreads) {
  const Slab slab = Of({Tissue(.2, 10, .8, 1.54, 1)});
  const SlabAnswer a = SolveByWalks(slab, {7000, 5, 1}, [](double) {}),
                   b = SolveByWalks(slab, {7000, 5, 3}, [](double) {});
  EXPECT_EQ(a.value.reflectance_collimated, b.value.reflectance_collimated);
  EXPECT_EQ(a.stddev.transmittance_diffuse, b.stddev.transmittance_diffuse);
}

}  // namespace
}  // namespace crownfit
