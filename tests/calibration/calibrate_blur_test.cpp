// Slanted edges: known blur and stray light recovered to within their standard deviations.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calibration/estimate_blur.h"
#include "support/rendered_target.h"

namespace crownfit {
namespace {

Image JigPhotograph(const RenderedLight& light) {
  const Camera camera{.width = 640, .height = 520, .fx = 4000, .fy = 4000, .cx = 320, .cy = 260, .distortion = {}};
  const PrintedTarget jig = PrintedJig({});
  return RenderTarget(jig, {0, 0}, camera, LookingAt({16, 24, 0}, 330, 6, 30, 2), light);
}

double FigureOf(const Product& product, const std::string& name) {
  for (const Figure& f : product.figures)
    if (f.name == name) return f.value;
  ADD_FAILURE() << "no figure " << name;
  return 0;
}

Product Measured(const Image& image, std::optional<double> dark = {}, std::optional<double> light = {}) {
  ImageFile photo;
  photo.image = image;
  BlurInput input;
  input.edges = FindSlantedSquare(photo);
  EXPECT_EQ(input.edges.size(), 4u);
  input.dark_reflectance = dark;
  input.light_reflectance = light;
  return BlurProduct(image, input);
}

TEST(CalibrateBlur, RecoversGaussianSigma) {
  for (const double sigma : {0.5, 0.8, 1.4, 2.5}) {
    const Product product = Measured(JigPhotograph({.level = 0.6, .sigma_px = sigma, .seed = 3}));
    EXPECT_NEAR(FigureOf(product, "sigma"), sigma, 3 * FigureOf(product, "sigma_stddev") + 0.01 * sigma);
    EXPECT_LT(FigureOf(product, "sigma_stddev"), 0.05 * sigma);
    EXPECT_TRUE(product.refusals.empty());
  }
}

TEST(CalibrateBlur, RecoversWideSecondGaussian) {
  const Product product =
      Measured(JigPhotograph({.level = 0.6, .sigma_px = 0.8, .wide_sigma_px = 3.0, .wide_weight = 0.15}));
  EXPECT_NEAR(FigureOf(product, "sigma"), 0.8, 3 * FigureOf(product, "sigma_stddev") + 0.02);
  EXPECT_NEAR(FigureOf(product, "wide_weight"), 0.15, 3 * FigureOf(product, "wide_weight_stddev") + 0.02);
  EXPECT_NEAR(FigureOf(product, "wide_sigma"), 3.0, 0.3);
}

TEST(CalibrateBlur, RecoversVeilingGlare) {
  for (const double glare : {0.0, 0.01, 0.05}) {
    const Product product = Measured(JigPhotograph({.level = 0.6, .veiling_glare = glare}), 0.04, 0.90);
    EXPECT_NEAR(FigureOf(product, "veiling_glare"), glare, 3 * FigureOf(product, "veiling_glare_stddev") + 0.002);
  }
}

TEST(CalibrateBlur, StandardDeviationsCoverTheScatter) {
  double squares = 0;
  constexpr int kTrials = 8;
  for (int i = 0; i < kTrials; ++i) {
    const Product product = Measured(JigPhotograph({.level = 0.6, .sigma_px = 1.0, .gain = 2e-4, .seed = 100u + i}));
    squares += std::pow((FigureOf(product, "sigma") - 1.0) / FigureOf(product, "sigma_stddev"), 2.0) / kTrials;
  }
  EXPECT_GT(std::sqrt(squares), 0.3);
  EXPECT_LT(std::sqrt(squares), 2.0);
}

bool Refuses(const Product& product, const std::string& part) {
  return std::any_of(product.refusals.begin(), product.refusals.end(),
                     [&](const auto& t) { return t.find(part) != std::string::npos; });
}

TEST(CalibrateBlur, APictureOutOfFocusIsRefused) {
  EXPECT_TRUE(Refuses(Measured(JigPhotograph({.level = 0.6, .sigma_px = 5.0})), "Focus on the square"));
}

TEST(CalibrateBlur, AShakenCameraIsRefused) {
  Image image = JigPhotograph({.level = 0.6, .sigma_px = 0.6});
  Image shaken = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      float sum = 0;
      for (int d = -2; d <= 2; ++d) sum += image.at(std::clamp(x + d, 0, image.width - 1), y, 0) / 5;
      shaken.at(x, y, 0) = sum;
    }
  EXPECT_TRUE(Refuses(Measured(shaken), "shook"));
}

TEST(CalibrateBlur, ASaturatedPaperIsRefused) {
  Image image = JigPhotograph({.level = 1.5});
  for (float& v : image.values) v = std::min(v, 1.0f);
  ImageFile photo;
  photo.image = image;
  BlurInput input;
  input.edges = FindSlantedSquare(photo);
  EXPECT_ANY_THROW(BlurProduct(image, input));
}

}  // namespace
}  // namespace crownfit
