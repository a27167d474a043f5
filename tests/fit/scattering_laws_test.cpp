// Laws of scattering over the channels: their free parameters, their benefit, and departures from them.

#include "fit/scattering_laws.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "capture/capture.h"
#include "support/channels.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// An incisor with every parameter fixed.
Capture AllFixed() {
  TemporaryFolder folder;
  WriteSyntheticCapture(folder.path, {.pixels = 20, .levels = 14});
  Capture capture = ReadCapture(folder.path);
  for (LayerSpec& layer : capture.layers)
    for (ParameterSpec& p : layer.parameters) p.fixed = true;
  for (ParameterSpec& p : capture.surface) p.fixed = true;
  return capture;
}

TEST(SharedScattering, IsAdvisedWhenDataErrorExceedsTypicalDeparture) {
  Capture capture = AllFixed();
  ParameterSpec& scattering = capture.layers[0][Quantity::kReducedScattering];
  scattering.fixed = false, scattering.sharing = Sharing::kNone;
  // The data identify each channel independently and equally well.
  const auto asked_at = [&](double stddev) {
    const auto asked = ScatteringThatMayBeShared(capture, [&](const Capture&, const FreeParameters& free) {
      DataEstimate knowledge;
      knowledge.covariance = stddev * stddev * Eigen::MatrixXd::Identity(free.count(), free.count());
      knowledge.unseen = Eigen::MatrixXd(free.count(), 0);
      return knowledge;
    });
    EXPECT_EQ(asked.size(), 1u);
    return asked.at(0);
  };
  const SharedScattering sharp = asked_at(0.005), dull = asked_at(0.1);
  EXPECT_FALSE(sharp.IsAdvised());
  EXPECT_TRUE(dull.IsAdvised());
  EXPECT_NEAR(dull.told / sharp.told, 20.0, 0.1);
  // The middle channel departs most. The departure contributes the share told^2 / stddev^2 of its variance.
  EXPECT_EQ(sharp.narrowed, capture.layers[0].name + ".reduced_scattering_per_mm[" + capture.channel_names[1] + "]");
  EXPECT_NEAR(std::pow(sharp.narrows, -2.0), 1.0 - std::pow(sharp.told / 0.005, 2), 1e-6);
  EXPECT_GE(std::pow(sharp.narrows, -2.0), 1.0 / 3.0);
}

TEST(LawDeparture, MeasuresOnlyTheComponentOutsideTheLaw) {
  Capture capture = AllFixed();
  ParameterSpec& scattering = capture.layers[0][Quantity::kReducedScattering];
  scattering.fixed = false;
  for (const auto& [law, freedom] : {std::pair{Sharing::kPowerLaw, 1}, {Sharing::kOneValue, 2}}) {
    scattering.sharing = law;
    const FreeParameters free = FreeParametersOf(
        WithoutLaws(capture, MaterialAt(FreeParametersOf(capture), StartVector(FreeParametersOf(capture)))));
    Eigen::VectorXd kept = Eigen::VectorXd::Zero(free.count());  // a level, and a slope
    for (int k = 0; k < free.count(); ++k) {
      const FreeEntry& e = free.entries[k];
      if (e.quantity == Quantity::kReducedScattering)
        kept[k] = 0.3 - (law == Sharing::kPowerLaw ? 0.7 * std::log(capture.wavelengths_nm[e.channel]) : 0.0);
    }
    const Eigen::MatrixXd covariance = 1e-4 * Eigen::MatrixXd::Identity(free.count(), free.count());
    const LawDeparture same = DeparturesFromLaws(capture, free, kept, covariance).at(0);
    EXPECT_EQ(same.freedom, freedom);
    EXPECT_NEAR(same.chi2, 0.0, 1e-12);
    Eigen::VectorXd left = kept;
    for (int k = 0; k < free.count(); ++k)
      if (free.entries[k].quantity == Quantity::kReducedScattering && free.entries[k].channel == 1) left[k] += 0.03;
    const LawDeparture d = DeparturesFromLaws(capture, free, left, covariance).at(0);
    // Only one channel moves. Its departure is scaled by the share of its variance that lies outside the law.
    EXPECT_NEAR(d.off[1], 0.03 * std::pow(d.stddev[1] / 0.01, 2), 1e-9);
    EXPECT_NEAR(d.chi2, 3.0 * 3.0 * std::pow(d.stddev[1] / 0.01, 2), 1e-6);
  }
}

TEST(Sharing, OptionSetsTheLawAndStartsOnIt) {
  TemporaryFolder folder;
  WriteSyntheticCapture(folder.path, {.pixels = 20, .levels = 14});
  Capture stated = ReadCapture(folder.path);
  const std::string name = stated.layers[1].name + ".reduced_scattering_per_mm";
  ParameterSpec& spec = stated.layers[1][Quantity::kReducedScattering];
  spec.value = {1.9, 2.2, 2.3}, spec.sharing = Sharing::kNone;
  const Spectrum value = spec.value;
  for (const auto& [sharing, less] : {std::pair{Sharing::kNone, 0}, {Sharing::kPowerLaw, 1}, {Sharing::kOneValue, 2}}) {
    Capture capture = stated;
    ApplyOverrides(capture, {{}, {}, {{name, sharing}}});
    const FreeParameters free = FreeParametersOf(capture);
    EXPECT_EQ(free.count(), FreeParametersOf(stated).count() - less) << Word(sharing);
    const Spectrum start = MaterialAt(free, StartVector(free)).layers[1][Quantity::kReducedScattering];
    double mean = 0;  // mean of logarithms, which every law preserves
    for (int c = 0; c < kChannels; ++c) mean += std::log(start[c] / value[c]);
    EXPECT_NEAR(mean, 0.0, 1e-12) << Word(sharing);
  }
  Capture capture = stated;
  EXPECT_THROW(ApplyOverrides(capture, {{}, {}, {{"surface.roughness", Sharing::kNone}}}), InputError);
  EXPECT_THROW(ApplyOverrides(capture, {{{name, value.list()}}, {}, {{name, Sharing::kNone}}}), InputError);
}

}  // namespace
}  // namespace crownfit
