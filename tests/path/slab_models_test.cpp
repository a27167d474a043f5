// Every model of flat layered samples against adding-doubling, where they must agree.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "optics/adding_doubling.h"
#include "path/slab_diffusion.h"
#include "path/slab_walk.h"
#include "shader/shader_slab.h"
#include "support/slabs.h"

namespace crownfit {
namespace {

/// Largest difference of a total from adding-doubling's, beyond `errors` standard errors.
double OffFromLayered(const Slab& slab, const SlabAnswer& a, double errors = 4.0) {
  const SlabTotals want = SolveByAddingDoubling(slab).value;
  const auto off = [&](double got, double right, double error) {
    return std::max(0.0, std::abs(got - right) - errors * error);
  };
  return std::max(
      {off(a.value.reflectance_collimated, want.reflectance_collimated, a.stddev.reflectance_collimated),
       off(a.value.transmittance_collimated, want.transmittance_collimated, a.stddev.transmittance_collimated),
       off(a.value.reflectance_diffuse, want.reflectance_diffuse, a.stddev.reflectance_diffuse),
       off(a.value.transmittance_diffuse, want.transmittance_diffuse, a.stddev.transmittance_diffuse)});
}

TEST(SlabDiffusion, ConvergesToAddingDoublingAsCollisionsGrow) {
  Slab on_white = Of({Tissue(.05, 15, .8, 1.54, 1)}), in_contact = on_white;
  on_white.backing_reflectance = in_contact.backing_reflectance = 0.8;
  in_contact.backing_contact = true;
  Slab under_glass = Of({Tissue(.05, 15, .8, 1.3, 1)});
  under_glass.ior_above = 1.5;
  const Slab two = Of({Tissue(.01, 6.6, .68, 1.63, 1), Tissue(.1, 28, .93, 1.54, 2)});
  const auto off = [](const Slab& slab, int collisions) {
    return OffFromLayered(slab, SolveByDiffusion(slab, {20000, 1, 0, collisions}, [](double) {}));
  };
  for (const Slab& slab : {on_white, in_contact, under_glass, two}) {
    EXPECT_LT(off(slab, 10), 0.006);
    EXPECT_LT(off(slab, 1500), 1e-4);
  }
}

TEST(SlabDiffusion, ConservesEnergyWithoutAbsorption) {
  const Slab slab = Of({Tissue(0, 6.6, .68, 1.63, 1), Tissue(0, 0, 0, 1.4, 0), Tissue(0, 28, .93, 1.54, 2)});
  const FlatEscape escape(FlatLayersOf(slab));
  for (const auto& [layer, height] : {std::pair<size_t, double>{0, 0.3}, {2, 0.0}, {2, 1.999}}) {
    const auto [up, down] = escape.From(layer, height);
    EXPECT_NEAR(up + down, 1.0, 1e-8);  // coupling through an empty layer costs digits
    EXPECT_GT(std::min(up, down), 0.05);
  }
}

TEST(ModelsOfSlabs, AgreeForThickWeaklyAbsorbingLayers) {
  const Slab thick = Of({Tissue(.005, 20, .8, 1.5, 20)});
  EXPECT_LT(OffFromLayered(thick, SolveByShader(thick)), 0.01);
  EXPECT_LT(OffFromLayered(thick, SolveByDiffusion(thick, {20000, 1, 0, 0}, [](double) {})), 0.004);
}

/// One to three layers over the whole range of every parameter. Each coefficient is zero in every fifth slab. Depth is
/// limited so that a walk ends soon.
Slab AnySlab(uint64_t number) {
  RandomStream random(Key(20, number));
  const auto between = [&](double low, double high) { return low + (high - low) * random.Next(); };
  const auto log_between = [&](double low, double high) { return low * std::pow(high / low, random.Next()); };
  const auto or_nothing = [&](double value) { return random.Next() < 0.2 ? 0.0 : value; };
  const auto index = [&] { return random.Next() < 0.5 ? 1.5 : between(1.0, 2.5); };  // often equal to the neighbours'
  constexpr double kDeepest = 100.0;
  Slab slab;
  const auto layers = static_cast<size_t>(between(1.0, 4.0));
  for (size_t l = 0; l < layers; ++l) {
    SlabLayer layer{index(),
                    between(-0.9, 0.96),
                    or_nothing(random.Next()),
                    or_nothing(log_between(0.01, 1000)),
                    or_nothing(log_between(1e-4, 30)),
                    log_between(1e-3, 5)};
    layer.thickness_mm = std::min(layer.thickness_mm, kDeepest / std::max(layer.scattering_per_mm, 1e-9));
    slab.layers.push_back(layer);
  }
  slab.ior_below = random.Next() < 0.7 ? 1.0 : index();
  slab.backing_reflectance = or_nothing(random.Next());
  slab.backing_contact = random.Next() < 0.5;
  return slab;
}

TEST(ModelsOfSlabs, RandomWalkAgreesWithAddingDoublingOnRandomSlabs) {
  constexpr int kSlabs = 100, kPhotons = 20000;
  constexpr double kErrors = 4.5, kSeenByNone = 48.0 / kPhotons;  // a quarter of the photons are diffuse
  for (uint64_t i = 0; i < kSlabs; ++i) {
    const Slab slab = AnySlab(i);
    const SlabAnswer layered = SolveByAddingDoubling(slab), walked = SolveByWalks(slab, {kPhotons, i}, [](double) {});
    EXPECT_LT(OffFromLayered(slab, walked, kErrors), kSeenByNone)
        << "slab " << i << ": " << SlabAnswerJson(layered) << SlabAnswerJson(walked);
    const auto in_all = [&](const SlabTotals& t) {
      EXPECT_GE(std::min({t.reflectance_collimated, t.transmittance_collimated, t.reflectance_diffuse,
                          t.transmittance_diffuse}),
                0.0)
          << "slab " << i;
      return std::max(t.reflectance_collimated + t.transmittance_collimated + layered.specular,
                      t.reflectance_diffuse + t.transmittance_diffuse + layered.specular_diffuse);
    };
    EXPECT_LE(in_all(layered.value), 1.0 + 1e-9) << "slab " << i;
    EXPECT_LE(in_all(walked.value), 1.0 + kErrors * in_all(walked.stddev)) << "slab " << i;
  }
}

}  // namespace
}  // namespace crownfit
