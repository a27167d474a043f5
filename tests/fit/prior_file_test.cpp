// Priors taken from the material of an earlier fit.

#include "fit/prior_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "capture/capture.h"
#include "support/channels.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// Free entries of a layer whose scattering is shared like this, with priors of a fit that found a value per channel.
std::vector<FreeEntry> EntriesWithPriors(Sharing sharing) {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "material.json") << R"({"format": "crownfit-material/1", "layers": [{"name": "glass",
    "reduced_scattering_per_mm": {"value": [1.0, 2.0, 4.0], "stddev": [0.1, 0.5, 0.2]}}]})";
  Capture capture;
  LayerSpec layer;
  layer.name = "glass";
  for (size_t i = 0; i < kParameters.size(); ++i)
    layer.parameters[i] = capture.surface[i] = DefaultSpec(kParameters[i], kChannels);
  layer[Quantity::kReducedScattering].fixed = false;
  layer[Quantity::kReducedScattering].sharing = sharing;
  capture.layers = {layer};
  FreeParameters free = FreeParametersOf(capture);
  TakePriors(folder.path / "material.json", capture, free);
  return free.entries;
}

TEST(PriorFile, EachEntryTakesMeanAndErrorOfTheSameChannel) {
  const std::vector<FreeEntry> apart = EntriesWithPriors(Sharing::kNone);
  ASSERT_EQ(apart.size(), 3u);
  const double value[] = {1, 2, 4}, stddev[] = {0.1, 0.5, 0.2};
  for (size_t c = 0; c < 3; ++c) {
    EXPECT_DOUBLE_EQ(apart[c].prior_mean, std::log(value[c]));
    EXPECT_DOUBLE_EQ(apart[c].prior_stddev, stddev[c] / value[c]);
  }
  const std::vector<FreeEntry> shared = EntriesWithPriors(Sharing::kOneValue);
  ASSERT_EQ(shared.size(), 1u);
  EXPECT_DOUBLE_EQ(shared[0].prior_mean, std::log(2.0)) << "the channel in the middle";
  EXPECT_DOUBLE_EQ(shared[0].prior_stddev, 0.25);
}

TEST(PriorFile, APowerLawTakesTheLineThroughTheChannels) {
  const std::vector<FreeEntry> law = EntriesWithPriors(Sharing::kPowerLaw);
  ASSERT_EQ(law.size(), 2u);
  // The values double from band to band. Least squares of ln value over ln(wavelength / 540 nm), by its normal
  // equations.
  const Capture defaults;
  double x_mean = 0, y_mean = 0, xx = 0, xy = 0;
  for (int c = 0; c < 3; ++c) {
    x_mean += std::log(defaults.wavelengths_nm[static_cast<size_t>(c)] / 540) / 3;
    y_mean += c * std::log(2.0) / 3;
  }
  for (int c = 0; c < 3; ++c) {
    const double x = std::log(defaults.wavelengths_nm[static_cast<size_t>(c)] / 540) - x_mean;
    xx += x * x;
    xy += x * (c * std::log(2.0) - y_mean);
  }
  EXPECT_NEAR(law[0].prior_mean, y_mean - xy / xx * x_mean, 1e-12);
  EXPECT_NEAR(law[1].prior_mean, -xy / xx, 1e-12);
}

}  // namespace
}  // namespace crownfit
