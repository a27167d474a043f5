// Colour charts are found, read and fitted. Damaged patches are excluded; unreliable charts are refused.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "base/files.h"
#include "base/random.h"
#include "calibration/colour_product.h"
#include "calibration/find_chart.h"
#include "capture/colour_file.h"
#include "photo/photograph.h"
#include "support/real_data.h"
#include "support/rendered_target.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

const glm::dmat3 kSensorFromRgb({0.62, 0.21, 0.03}, {0.30, 0.70, 0.25}, {0.05, 0.12, 0.55});

/// A chart on grey, turned by `turn_deg`, as the camera sees it.
struct ChartScene {
  double turn_deg = 0, level = 0.8, patch_px = 44;
  uint64_t seed = 1;

  ImageFile Photograph(const Chart& chart, const std::function<glm::dvec3(int, glm::dvec3)>& change = {}) const {
    ImageFile file;
    file.image = Image(520, 480, 3);
    const double a = turn_deg * 3.14159265358979 / 180;
    for (int y = 0; y < file.image.height; ++y)
      for (int x = 0; x < file.image.width; ++x) {
        glm::dvec3 sum(0.0);
        for (int s = 0; s < 9; ++s) {
          const glm::dvec2 d = glm::dvec2(x + (s % 3 + 0.5) / 3, y + (s / 3 + 0.5) / 3) - glm::dvec2(260, 240);
          const glm::dvec2 p =
              glm::dvec2(std::cos(a) * d.x + std::sin(a) * d.y, -std::sin(a) * d.x + std::cos(a) * d.y) / patch_px;
          // In units of patches; the gaps between them are a tenth as wide.
          const glm::dvec2 at = (p + glm::dvec2(3.25, 2.15)) / 1.1;
          const int column = static_cast<int>(std::floor(at.x)), row = static_cast<int>(std::floor(at.y));
          const bool on_patch =
              at.x >= 0 && at.y >= 0 && column < 6 && row < 4 && at.x - column < 1 / 1.1 && at.y - row < 1 / 1.1;
          const bool on_card = std::abs(p.x) < 3.7 && std::abs(p.y) < 2.6;
          glm::dvec3 rgb(on_card ? 0.025 : 0.4);
          if (on_patch) rgb = chart.patches[row * 6 + column].linear_rgb;
          glm::dvec3 sensor = level * (kSensorFromRgb * rgb);
          if (on_patch && change) sensor = change(row * 6 + column, sensor);
          sum += sensor / 9.0;
        }
        for (int c = 0; c < 3; ++c) file.image.at(x, y, c) = static_cast<float>(sum[c]);
      }
    file.image = Noisy(file.image, 5e-5, 1e-3, seed);
    return file;
  }
};

Product Calibrated(const ImageFile& photo, const Chart& chart) {
  Image linear = photo.image;
  for (float& v : linear.values) v = static_cast<float>(photo.transfer.Light(v, 0));
  const auto corners = FindClassicChart(photo, linear, chart);
  if (!corners) {
    Product product;
    product.refusals.push_back("not found");
    return product;
  }
  return ColourProduct(chart, ReadPatches(linear, chart, *corners, kClassicGap, glm::dvec3(0.98)),
                       {nullptr, photo.transfer.is_encoded(), photo.is_jpeg});
}

double FigureOf(const Product& product, const std::string& name) {
  for (const Figure& f : product.figures)
    if (f.name == name) return f.value;
  return -1;
}

bool AnyContains(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const auto& t) { return t.find(part) != std::string::npos; });
}

ColourTransform TransformIn(const Product& product) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "colour.json", ToJsonText(ProductJson(product, {})));
  return ReadColourTransform(folder.path / "colour.json");
}

const Chart& Classic() {
  static const Chart chart = ReadChart("colorchecker_classic_2014");
  return chart;
}

TEST(CalibrateColour, ReferenceValuesMatchWhiteGreyAndBlack) {
  ASSERT_EQ(Classic().patches.size(), 24u);
  const glm::dvec3 white = Classic().patches[18].linear_rgb, black = Classic().patches[23].linear_rgb;
  EXPECT_NEAR(white.y, 0.88, 0.02);
  EXPECT_NEAR(black.y, 0.031, 0.003);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(Classic().patches[20].linear_rgb[c], 0.36, 0.02) << "neutral";
}

TEST(CalibrateColour, AKnownCameraIsRecoveredFromAnyAngle) {
  for (const double turn : {0.0, 7.0, 90.0, 180.0, 265.0}) {
    ChartScene scene;
    scene.turn_deg = turn;
    scene.patch_px = 40;
    const ImageFile photo = scene.Photograph(Classic());
    const Image& linear = photo.image;
    const auto corners = FindClassicChart(photo, linear, Classic());
    ASSERT_TRUE(corners) << turn;
    std::string fault;
    auto readings = InOrder(Classic(), ReadPatches(linear, Classic(), *corners, kClassicGap, glm::dvec3(0.98)), fault);
    ASSERT_TRUE(fault.empty()) << turn << ": " << fault;
    const auto estimate = EstimateColour(Classic(), readings);
    ASSERT_TRUE(estimate) << turn;
    EXPECT_LT(estimate->mean, 0.4) << turn;
    EXPECT_LT(estimate->leave_one_out, 0.6) << turn;
    EXPECT_EQ(estimate->used.size(), 24u);
    EXPECT_FALSE(estimate->transform.root_polynomial) << "a matrix is the truth";
    const std::vector<glm::dvec3>& columns = estimate->transform.columns;
    ASSERT_EQ(columns.size(), 3u);
    const glm::dmat3 identity = glm::dmat3(columns[0], columns[1], columns[2]) * (scene.level * kSensorFromRgb);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) EXPECT_NEAR(identity[c][r], c == r, 0.02) << turn;
    EXPECT_NEAR(estimate->tone_slope, 1.0, 0.02);
    const glm::dvec3 white = scene.level * (kSensorFromRgb * glm::dvec3(1.0));
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(estimate->white[c] / white[c], 1.0, 0.01) << "a perfect white; the chart's white is yellowish";
  }
}

TEST(CalibrateColour, ScratchedAndGlarePatchesAreExcludedAndNamed) {
  const ImageFile photo = ChartScene().Photograph(Classic(), [](int patch, glm::dvec3 v) {
    return patch == 9 ? v * 0.3 + 0.2 : v;  // glare over all of "purple"
  });
  ImageFile scratched = photo;
  for (int y = 0; y < scratched.image.height; ++y)  // a white stroke across "moderate red"
    for (int x = 0; x < scratched.image.width; ++x)
      if (std::abs(x - 235 - (y - 215)) < 7 && std::abs(y - 218) < 26)
        for (int c = 0; c < 3; ++c) scratched.image.at(x, y, c) = 0.7f;
  const Product product = Calibrated(scratched, Classic());
  EXPECT_TRUE(product.refusals.empty());
  EXPECT_TRUE(AnyContains(product.notes, "(purple) is not used: does not fit")) << product.notes.size();
  EXPECT_TRUE(AnyContains(product.notes, "(moderate red) is not used: uneven")) << product.notes.size();
  EXPECT_LT(FigureOf(product, "de00_mean"), 0.5);
}

TEST(CalibrateColour, AMirroredChartIsRefused) {
  ImageFile photo = ChartScene().Photograph(Classic());
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < photo.image.width / 2; ++x)
      for (int c = 0; c < 3; ++c) std::swap(photo.image.at(x, y, c), photo.image.at(photo.image.width - 1 - x, y, c));
  EXPECT_TRUE(AnyContains(Calibrated(photo, Classic()).refusals, "mirrored"));
}

TEST(CalibrateColour, AHalfHiddenChartIsRefused) {
  ImageFile photo = ChartScene().Photograph(Classic());
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < 250; ++x)
      for (int c = 0; c < 3; ++c) photo.image.at(x, y, c) = static_cast<float>(0.1 + 0.1 * (c == 1));
  EXPECT_FALSE(Calibrated(photo, Classic()).refusals.empty());
}

TEST(CalibrateColour, AToneCurveIsRefused) {
  const ImageFile photo =
      ChartScene().Photograph(Classic(), [](int, glm::dvec3 v) { return glm::pow(v, glm::dvec3(0.6)); });
  EXPECT_TRUE(AnyContains(Calibrated(photo, Classic()).refusals, "tone curve"));
}

TEST(CalibrateColour, EachChannelHasItsOwnSaturationLevel) {
  const ImageFile photo = ChartScene().Photograph(Classic());
  const auto corners = FindClassicChart(photo, photo.image, Classic());
  ASSERT_TRUE(corners);
  const auto saturated = [&](const glm::dvec3& levels) {
    const auto readings = ReadPatches(photo.image, Classic(), *corners, kClassicGap, levels);
    return std::count_if(readings.begin(), readings.end(), [](const auto& r) { return r.damage == "saturated"; });
  };
  EXPECT_EQ(saturated(glm::dvec3(10.0)), 0);
  for (int c = 0; c < 3; ++c) {
    glm::dvec3 levels(10.0);
    levels[c] = 0.3;
    EXPECT_GT(saturated(levels), 0) << c;
  }
}

TEST(CalibrateColour, UnevenLightIsReported) {
  ImageFile photo = ChartScene().Photograph(Classic());
  for (int y = 0; y < photo.image.height; ++y)
    for (int x = 0; x < photo.image.width; ++x)
      for (int c = 0; c < 3; ++c) photo.image.at(x, y, c) *= static_cast<float>(1.0 + 0.3 * (x - 260) / 260.0);
  EXPECT_TRUE(AnyContains(Calibrated(photo, Classic()).notes, "--flat-field"));
}

TEST(CalibrateColour, GreyCardGivesOnlyTheWhiteBalance) {
  Image card(60, 40, 3);
  const glm::dvec3 grey(0.11, 0.18, 0.13);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 60; ++x)
      for (int c = 0; c < 3; ++c)
        card.at(x, y, c) = static_cast<float>(grey[c] * (1 + 0.02 * (Uniform(Key(3, y, x), c) - 0.5)));
  const Product product = GreyCardProduct(card, {5, 5, 50, 30}, 0.18, glm::dvec3(1.0), {});
  EXPECT_TRUE(product.refusals.empty());
  const ColourTransform transform = TransformIn(product);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(transform(grey)[c], 0.18, 3e-4);
  EXPECT_EQ(transform.columns[1][0], 0.0);
  EXPECT_TRUE(AnyContains(product.notes, "only the white balance"));
}

TEST(CalibrateColour, AGreyCardInGlareOrTooBrightIsRefused) {
  Image card(60, 40, 3, 0.3f);
  EXPECT_TRUE(AnyContains(GreyCardProduct(card, {5, 5, 70, 30}, 0.18, glm::dvec3(1.0), {}).refusals, "outside"));
  EXPECT_TRUE(AnyContains(GreyCardProduct(card, {5, 5, 50, 30}, 0.18, glm::dvec3(0.3), {}).refusals, "saturated"));
  EXPECT_TRUE(AnyContains(GreyCardProduct(card, {5, 5, 50, 30}, 0.18, glm::dvec3(0.3, 1, 1), {}).refusals, "saturated"))
      << "saturated in any channel";
  for (int y = 0; y < 40; ++y)
    for (int x = 30; x < 60; ++x)
      for (int c = 0; c < 3; ++c) card.at(x, y, c) = 0.4f;
  EXPECT_TRUE(AnyContains(GreyCardProduct(card, {5, 5, 50, 30}, 0.18, glm::dvec3(1.0), {}).refusals, "glare"));
}

TEST(CalibrateColour, LeaveOneOutErrorSelectsThePolynomial) {
  // The sensor's crosstalk is proportional to the geometric mean of two channels: no matrix undoes it.
  const ImageFile photo = ChartScene().Photograph(Classic(), [](int, glm::dvec3 v) {
    return glm::dvec3(v.x, v.y, v.z) + 0.25 * glm::dvec3(std::sqrt(v.x * v.y), 0.0, -0.5 * std::sqrt(v.y * v.z));
  });
  std::string fault;
  auto readings = InOrder(Classic(),
                          ReadPatches(photo.image, Classic(), *FindClassicChart(photo, photo.image, Classic()),
                                      kClassicGap, glm::dvec3(0.98)),
                          fault);
  const auto estimate = EstimateColour(Classic(), readings);
  ASSERT_TRUE(estimate);
  EXPECT_TRUE(estimate->transform.root_polynomial);
  EXPECT_LT(estimate->leave_one_out, 0.9 * estimate->leave_one_out_matrix);
  const glm::dvec3 v(0.3, 0.2, 0.1);
  EXPECT_NEAR(glm::length(estimate->transform(2.0 * v) - 2.0 * estimate->transform(v)), 0.0, 1e-12)
      << "scales with exposure";
}

// Photographs made elsewhere.

TEST(CalibrateColourReal, RawColorCheckerPassportFits) {
  REQUIRE_REAL_DATA("colorchecker-passport-dng");
  const Product product = Calibrated(ReadImageFile(real / "colorchart.dng"), Classic());
  EXPECT_TRUE(product.refusals.empty());
  EXPECT_LT(FigureOf(product, "de00_mean"), 3.0);
  EXPECT_GE(FigureOf(product, "patches_used"), 22);
  std::printf("de00 mean %.2f, worst %.2f, leave-one-out %.2f\n", FigureOf(product, "de00_mean"),
              FigureOf(product, "de00_worst"), FigureOf(product, "de00_leave_one_out"));
}

TEST(CalibrateColourReal, PlantPhotographCardsAreFittedOrRefused) {
  REQUIRE_REAL_DATA("colorchecker-plantcv");
  for (const std::string name : {"classic.png", "colorchecker-classic-mini.jpg"}) {
    const Product product = Calibrated(ReadImageFile(real / name), Classic());
    EXPECT_TRUE(product.refusals.empty()) << name;
    EXPECT_TRUE(AnyContains(product.notes, "encoded for display")) << name;
    EXPECT_LT(FigureOf(product, "de00_mean"), 5.0) << name;
  }
  // Charts with a strong in-camera tone curve are found in the right order, measured and refused.
  for (const std::string name : {"source1_img.png", "target_img.png"}) {
    const Product product = Calibrated(ReadImageFile(real / name), Classic());
    EXPECT_GE(FigureOf(product, "patches_used"), 20) << name;
    EXPECT_TRUE(AnyContains(product.refusals, "tone curve")) << name;
  }
  // A card of 50 pixels, whose light patches are saturated.
  EXPECT_LT(FigureOf(Calibrated(ReadImageFile(real / "tobacco_leaves.jpg"), Classic()), "de00_mean"), 5.0);
  EXPECT_FALSE(Calibrated(ReadImageFile(real / "partial_card_rgb.png"), Classic()).refusals.empty());
}

TEST(CalibrateColourReal, OverexposedTungstenChartIsRefused) {
  REQUIRE_REAL_DATA("ccm-opencv-case");
  std::ifstream file(real / "patches.csv");
  std::vector<PatchReading> readings;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("#") || line.starts_with("name")) continue;
    std::istringstream words(line.substr(line.find(',') + 1));
    PatchReading reading;
    for (int c = 0; c < 3; ++c) {
      std::string value;
      std::getline(words, value, ',');
      reading.mean[c] = std::pow(std::stod(value) / 255, 2.2);
    }
    readings.push_back(reading);
  }
  ASSERT_EQ(readings.size(), 24u);
  const Product product = ColourProduct(Classic(), readings, {});
  EXPECT_FALSE(product.refusals.empty());
}

}  // namespace
}  // namespace crownfit
