// Photon transfer and exposure series: known sensors recovered, and a real one.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/random.h"
#include "calibration/estimate_noise.h"
#include "calibration/exposure_series.h"
#include "calibration/noise_product.h"
#include "photo/photograph.h"
#include "support/real_data.h"
#include "support/rendered_target.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

constexpr double kGain = 3e-4, kRead = 2e-3, kBlack = 0.03;

/// Patches from black to nearly white, with edges between them.
Image Scene(double exposure, int shift = 0) {
  Image image(256, 160, 1);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image.at(x, y, 0) = static_cast<float>(exposure * std::pow(0.82, ((x + shift) / 16 + 3 * (y / 32)) % 24));
  return image;
}

/// The image as a sensor records it: noise, black level, saturation and 12-bit quantisation.
Image Photographed(const Image& light, uint64_t seed) {
  Image image = Noisy(light, kGain, kRead, seed);
  for (float& v : image.values) v = std::round(std::clamp(v + static_cast<float>(kBlack), 0.0f, 1.0f) * 4095) / 4095;
  return image;
}

TEST(CalibrateNoise, RecoversKnownSensorWithinStandardDeviations) {
  double worst = 0, squares = 0;
  constexpr int kTrials = 12;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Image a = Photographed(Scene(0.8), 10 * trial), b = Photographed(Scene(0.8), 10 * trial + 1);
    const Image dark = Photographed(Image(256, 160, 1), 10 * trial + 2),
                dark2 = Photographed(Image(256, 160, 1), 10 * trial + 3);
    const auto noise = EstimateChannelNoise({{&a, &b}}, {&dark, &dark2}, 0);
    ASSERT_TRUE(noise);
    const double z[] = {(noise->gain - kGain) / noise->gain_stddev,
                        (noise->read_noise - kRead) / noise->read_noise_stddev};
    for (const double one : z) worst = std::max(worst, std::abs(one)), squares += one * one / (2 * kTrials);
    EXPECT_LT(noise->gain_stddev, 0.03 * kGain);
    EXPECT_NEAR(noise->black, kBlack, 1e-4);
  }
  EXPECT_LT(worst, 3.5);
  EXPECT_GT(std::sqrt(squares), 0.5) << "standard deviations far too large";
  EXPECT_LT(std::sqrt(squares), 1.6) << "standard deviations too small";
}

TEST(CalibrateNoise, UnequalExposuresGiveTheSameSensor) {
  const Image a = Photographed(Scene(0.9), 1), b = Photographed(Scene(0.3), 2);
  const Image dark = Photographed(Image(256, 160, 1), 3), dark2 = Photographed(Image(256, 160, 1), 4);
  const auto noise = EstimateChannelNoise({{&b, &a}}, {&dark, &dark2}, 0);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->gain, kGain, 3.5 * noise->gain_stddev);
  EXPECT_NEAR(noise->read_noise, kRead, 3.5 * noise->read_noise_stddev);
  EXPECT_LT(noise->nonlinearity, 0.02);
}

TEST(CalibrateNoise, SaturationIsWhereValuesPileUp) {
  const Image a = Photographed(Scene(1.6), 1), b = Photographed(Scene(1.6), 2);
  const auto noise = EstimateChannelNoise({{&a, &b}}, {}, 0);
  ASSERT_TRUE(noise && noise->saturation);
  EXPECT_NEAR(*noise->saturation, 0.98, 0.01);
  EXPECT_NEAR(noise->gain, kGain, 4 * noise->gain_stddev + kGain * kBlack)
      << "no dark frame: the black level counts as light";
}

TEST(CalibrateNoise, DarkFramesClippedAtZeroDoNotSetTheReadNoise) {
  Image a = Noisy(Scene(0.8), kGain, kRead, 1), b = Noisy(Scene(0.8), kGain, kRead, 2);
  Image dark = Noisy(Image(256, 160, 1), kGain, kRead, 3), dark2 = Noisy(Image(256, 160, 1), kGain, kRead, 4);
  for (Image* image : {&a, &b, &dark, &dark2})
    for (float& v : image->values) v = std::max(v, 0.0f);
  const auto noise = EstimateChannelNoise({{&a, &b}}, {&dark, &dark2}, 0);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->read_noise, kRead, 4 * noise->read_noise_stddev) << "half the noise is missing in the dark frames";
}

bool AnyContains(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const auto& t) { return t.find(part) != std::string::npos; });
}

TEST(CalibrateNoise, BlackLevelWithoutDarkFramesIsReported) {
  const auto shifted = [](uint64_t seed) {
    Image image = Noisy(Scene(0.8), kGain, 1e-3, seed);
    for (float& v : image.values) v += 0.06f;
    return image;
  };
  const Image a = shifted(1), b = shifted(2);
  const auto noise = EstimateChannelNoise({{&a, &b}}, {}, 0);
  ASSERT_TRUE(noise);
  EXPECT_NEAR(noise->hidden_black, 0.06, 0.01);
  EXPECT_TRUE(AnyContains(NoiseProduct({{&a, &b}}, {}).notes, "--dark"));
  const Image c = Noisy(Scene(0.8), kGain, 1e-3, 3), d = Noisy(Scene(0.8), kGain, 1e-3, 4);
  EXPECT_EQ(EstimateChannelNoise({{&c, &d}}, {}, 0)->hidden_black, 0.0);
}

TEST(CalibrateNoise, QuantisedDarkFramesDoNotMakeReadNoiseExact) {
  const auto in_steps = [](Image image) {
    for (float& v : image.values) v = std::round(v * 255) / 255;
    return image;
  };
  const Image a = in_steps(Noisy(Scene(0.8), 2e-4, 4e-4, 1)), b = in_steps(Noisy(Scene(0.8), 2e-4, 4e-4, 2)),
              dark = in_steps(Image(256, 160, 1));
  const auto noise = EstimateChannelNoise({{&a, &b}}, {&dark, &dark}, 0);
  ASSERT_TRUE(noise);
  EXPECT_GT(noise->read_noise_stddev, 2e-5) << "read noise is not stated as exact";
  EXPECT_NEAR(noise->black_stddev, 1.0 / 255 / std::sqrt(12.0), 1e-6);
}

TEST(CalibrateNoise, AMovedCameraIsRefused) {
  const Image a = Photographed(Blurred(Scene(0.8), 1.0), 1), b = Photographed(Blurred(Scene(0.8, 1), 1.0), 2);
  const Product product = NoiseProduct({{&a, &b}}, {});
  EXPECT_TRUE(AnyContains(product.refusals, "moved")) << "figures: " << product.figures.size();
}

TEST(CalibrateNoise, AToneCurveIsRefused) {
  Image a = Scene(0.9), b = Scene(0.3);
  for (Image* image : {&a, &b})
    for (float& v : image->values) v = static_cast<float>(SrgbFromLinear(v));
  a = Noisy(a, kGain, kRead, 1);
  b = Noisy(b, kGain, kRead, 2);
  EXPECT_TRUE(AnyContains(NoiseProduct({{&a, &b}}, {}).refusals, "not proportional to the light"));
}

// Exposure series.

TEST(ExposureSeries, MergedValuesAreUnbiasedAndTheirVarianceIsRight) {
  ExposureSeries series;
  series.times = {1, 4, 16};
  for (int k = 0; k < 3; ++k) series.photographs.push_back(Photographed(Scene(0.9 * series.times[k]), 7 + k));
  series.noise.gain = {kGain, kGain, kGain};
  series.noise.read_noise = {kRead, kRead, kRead};
  series.noise.black = {kBlack, kBlack, kBlack};
  series.noise.relative = 0;
  const MergedExposures merged = MergeExposures(series);
  const Image truth = Scene(0.9);
  double sum = 0, squares = 0, darkest = 0;
  for (size_t i = 0; i < truth.values.size(); ++i) {
    const double z = (merged.linear.values[i] - truth.values[i]) / std::sqrt(merged.variance.values[i]);
    sum += z;
    squares += z * z;
    if (truth.values[i] < 0.012) darkest = std::max<double>(darkest, std::sqrt(merged.variance.values[i]));
  }
  const double n = static_cast<double>(truth.values.size());
  EXPECT_LT(std::abs(sum / n), 0.05);
  EXPECT_NEAR(squares / n, 1.0, 0.08);
  EXPECT_LT(darkest, 0.3 * kRead) << "sixteen times the light must help";
  EXPECT_LT(merged.worst_ratio, 0.01);
}

TEST(ExposureSeries, MovedCameraIsDetected) {
  const auto shift = [](int px) {
    ExposureSeries series;
    series.times = {1, 4};
    series.photographs = {Photographed(Blurred(Scene(0.15), 2.0), 3), Photographed(Blurred(Scene(0.6, px), 2.0), 4)};
    series.noise.black = {kBlack, kBlack, kBlack};
    return MergeExposures(series).shift_px;
  };
  EXPECT_LT(shift(0), 0.1);
  EXPECT_NEAR(shift(1), 1.0, 0.2);
  EXPECT_GT(shift(3), 1.0);
}

TEST(ExposureSeries, WrongExposureTimeIsDetected) {
  ExposureSeries series;
  series.times = {1, 4, 20};
  for (const double t : {1.0, 4.0, 16.0}) series.photographs.push_back(Photographed(Scene(0.9 * t), 3));
  series.noise.black = {kBlack, kBlack, kBlack};
  EXPECT_NEAR(MergeExposures(series).time_ratios[1].value(), 0.8, 0.01);
}

TEST(ExposureSeries, GrossOrSwappedExposureTimesAreDetected) {
  ExposureSeries series;
  series.noise.black = {kBlack, kBlack, kBlack};
  series.photographs = {Photographed(Scene(0.9), 3), Photographed(Scene(3.6), 4)};
  series.times = {1, 40};
  EXPECT_LT(MergeExposures(series).time_ratios[0].value(), 0.2) << "0.1, apart from noise";
  std::swap(series.photographs[0], series.photographs[1]);
  series.times = {1, 4};
  EXPECT_NEAR(MergeExposures(series).time_ratios[0].value(), 1.0 / 16, 0.01);
  series.photographs = {Photographed(Scene(0.01), 3), Photographed(Scene(0.04), 4)};
  EXPECT_FALSE(MergeExposures(series).time_ratios[0]) << "no pixel is bright enough to tell";
}

TEST(CalibrateNoise, UnsaturatedChannelKeepsOtherSaturationLevels) {
  const auto colours = [](uint64_t seed) {
    Image image(256, 160, 3);
    const Image bright = Photographed(Scene(1.6), seed), dim = Photographed(Scene(0.8), seed);
    for (size_t i = 0; i < bright.values.size(); ++i)
      for (size_t c = 0; c < 3; ++c)
        image.values[3 * i + c] = c == 1 ? std::min(bright.values[i], 0.8f) : dim.values[i];
    return image;
  };
  const Image a = colours(1), b = colours(2);
  const Product product = NoiseProduct({{&a, &b}}, {});
  EXPECT_TRUE(product.refusals.empty());
  EXPECT_TRUE(AnyContains(product.notes, "channel R was not saturated"));
  EXPECT_FALSE(AnyContains(product.notes, "no pixel was saturated"));
  const auto saturation = std::find_if(product.content.begin(), product.content.end(),
                                       [](const auto& entry) { return entry.first == "saturation"; });
  ASSERT_NE(saturation, product.content.end());
  const auto& levels = std::get<JsonValue::Array>(saturation->second.data);
  EXPECT_NEAR(std::get<double>(levels[1].data), 0.8, 0.02);
  EXPECT_EQ(std::get<double>(levels[0].data), 0.995);
}

TEST(ExposureSeries, RecoversTheResponseOfAnEncodingCamera) {
  // A curve that is not sRGB's.
  const auto encoded = [](double v) { return std::pow(std::clamp(v, 0.0, 1.0), 1.0 / 1.8); };
  std::vector<ImageFile> files;
  const std::vector<double> times{1, 2, 4, 8, 16};
  for (const double t : times) {
    Image light(256, 160, 3);
    for (int y = 0; y < light.height; ++y)
      for (int x = 0; x < light.width; ++x)
        for (int c = 0; c < 3; ++c)
          light.at(x, y, c) = static_cast<float>(0.9 * t * std::pow(10.0, -2.5 * x / 256.0 - 0.2 * c));
    ImageFile file;
    file.image = Noisy(light, 2e-5, 5e-4, 11);
    for (float& v : file.image.values) v = static_cast<float>(std::round(255 * encoded(v)) / 255);
    file.transfer.kind = Transfer::Kind::kSrgb;
    files.push_back(file);
  }
  const auto response = EstimateResponse(files, times);
  for (int v = 40; v <= 240; v += 20)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(response[v][c] / response[200][c], std::pow(v / 200.0, 1.8),
                  0.05 * std::max(0.3, std::pow(v / 200.0, 1.8)))
          << v << " " << c;
}

/// The series of one band, from the shortest exposure to the longest.
ExposureSeries SeriesOf(const std::filesystem::path& real, const std::string& band) {
  std::map<double, std::filesystem::path> frames;
  for (const auto& entry : std::filesystem::directory_iterator(real / "captured")) {
    const std::string name = entry.path().filename().string(), start = "d2_colorChecker30cm_" + band + "nm_";
    if (name.starts_with(start)) frames[std::stod(name.substr(start.size()))] = entry.path();
  }
  ExposureSeries series;
  for (const auto& [time, file] : frames) {
    series.times.push_back(time);
    series.photographs.push_back(ReadImageFile(file).image);
  }
  return series;
}

TEST(ExposureSeriesReal, SevenFilteredBandsAreOnePhotographOfSevenChannels) {
  REQUIRE_REAL_DATA("colorchecker-flea3-bracket");
  const TemporaryFolder folder;
  PhotographFiles files;
  files.channel_names.clear();
  std::vector<MergedExposures> merged;
  for (const char* band : {"700", "650", "600", "550", "500", "450", "400"}) {
    const ExposureSeries series = SeriesOf(real, band);
    ASSERT_EQ(series.photographs.size(), 7u) << band;
    merged.push_back(MergeExposures(series));
    files.channel_names.push_back(std::string(band) + " nm");
    files.planes.push_back(folder.path / (std::string(band) + ".exr"));
    WriteImageFile(files.planes.back(), merged.back().linear, false, {"Y"});
  }
  files.image = files.planes[0];
  const Photograph photo = ReadPhotograph(files);
  ASSERT_EQ(photo.linear.channels, 7);
  for (int c = 0; c < 7; ++c)
    for (size_t p = 0; p < photo.usable.size(); ++p)
      ASSERT_EQ(photo.linear.values[7 * p + c], merged[static_cast<size_t>(c)].linear.values[p]) << c;
}

TEST(ExposureSeriesReal, MachineVisionFramesAreLinearAndMerge) {
  REQUIRE_REAL_DATA("colorchecker-flea3-bracket");
  const Image labels = ReadImageFile(real / "labels/d2_colorChecker30cm_550nm_labels.png").image;
  for (const std::string band : {"450", "500", "550", "600", "650"}) {  // 400 and 700 nm are too dark to compare
    const ExposureSeries series = SeriesOf(real, band);
    ASSERT_EQ(series.photographs.size(), 7u);
    std::vector<std::pair<const Image*, const Image*>> pairs;
    for (size_t k = 0; k + 1 < series.photographs.size(); ++k)
      pairs.emplace_back(&series.photographs[k], &series.photographs[k + 1]);
    const auto noise = EstimateChannelNoise(pairs, {}, 0);
    ASSERT_TRUE(noise);
    EXPECT_GT(noise->gain, 2.0 * noise->gain_stddev);
    EXPECT_LT(noise->read_noise, 1.0 / 255) << "less than a step";
    const MergedExposures merged = MergeExposures(series);
    EXPECT_LT(merged.worst_ratio, 0.035);

    // Patches against the authors' merged image. The authors scale exposures by factors found per channel, which differ
    // from the exposure times (docs/validation.md). The ratio is therefore compared among patches of one exposure.
    std::filesystem::path published;
    for (const auto& entry : std::filesystem::directory_iterator(real / "published_hdr"))
      if (entry.path().filename().string().find(band + "nm") != std::string::npos) published = entry.path();
    const Image theirs = ReadImageFile(published).image;
    const auto median = [&](const Image& image, int patch, int y0, int x0) {
      std::vector<float> values;
      for (int y = 4 + y0; y < image.height - 4; y += 2)
        for (int x = 4 + x0; x < image.width - 4; x += 2) {
          bool inside = true;
          for (int d = -4; d <= 4; d += 4)
            for (int e = -4; e <= 4; e += 4) inside &= std::lround(255 * labels.at(x + d, y + e, 0)) == patch;
          if (inside) values.push_back(image.at(x, y, 0));
        }
      std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
      return values[values.size() / 2];
    };
    std::map<std::tuple<int, int, size_t>, std::vector<double>> ratios;  // by colour position, longest exposure
    for (int patch = 1; patch <= 24; ++patch) {
      // Position of the band's colour in the GBRG mosaic.
      const double nm = std::stod(band);
      const int y = nm >= 600, x = nm <= 450;
      size_t longest = 0;
      for (size_t k = 0; k < 7; ++k)
        if (median(series.photographs[k], patch, y, x) < 0.95) longest = k;
      if (median(series.photographs[longest], patch, y, x) < 0.2) continue;
      ratios[{y, x, longest}].push_back(median(merged.linear, patch, y, x) / median(theirs, patch, y, x));
    }
    std::vector<double> departures;
    for (auto& [key, values] : ratios) {
      std::sort(values.begin(), values.end());
      const double middle = values[values.size() / 2];
      std::printf("%s nm, place %d%d, up to %4.0f ms: %zu patches, ours over theirs %.3f (%.3f to %.3f)\n",
                  band.c_str(), std::get<0>(key), std::get<1>(key), series.times[std::get<2>(key)], values.size(),
                  middle, values.front(), values.back());
      if (values.size() > 2)
        for (const double v : values) departures.push_back(std::abs(v / middle - 1));
    }
    std::sort(departures.begin(), departures.end());
    EXPECT_LT(departures[departures.size() / 2], 0.03) << "half of the patches";
  }
}

}  // namespace
}  // namespace crownfit
