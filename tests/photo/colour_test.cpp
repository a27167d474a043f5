#include "photo/colour.h"

#include <gtest/gtest.h>

#include <cmath>

#include "photo/colour_difference.h"

namespace crownfit {
namespace {

TEST(Colour, Ciede2000MatchesThe34PublishedPairs) {
  // Sharma, Wu and Dalal 2005, table 1: L1 a1 b1, L2 a2 b2, CIEDE2000.
  static constexpr double kPairs[34][7] = {{50, 2.6772, -79.7751, 50, 0, -82.7485, 2.0425},
                                           {50, 3.1571, -77.2803, 50, 0, -82.7485, 2.8615},
                                           {50, 2.8361, -74.0200, 50, 0, -82.7485, 3.4412},
                                           {50, -1.3802, -84.2814, 50, 0, -82.7485, 1.0000},
                                           {50, -1.1848, -84.8006, 50, 0, -82.7485, 1.0000},
                                           {50, -0.9009, -85.5211, 50, 0, -82.7485, 1.0000},
                                           {50, 0, 0, 50, -1, 2, 2.3669},
                                           {50, -1, 2, 50, 0, 0, 2.3669},
                                           {50, 2.4900, -0.0010, 50, -2.4900, 0.0009, 7.1792},
                                           {50, 2.4900, -0.0010, 50, -2.4900, 0.0010, 7.1792},
                                           {50, 2.4900, -0.0010, 50, -2.4900, 0.0011, 7.2195},
                                           {50, 2.4900, -0.0010, 50, -2.4900, 0.0012, 7.2195},
                                           {50, -0.0010, 2.4900, 50, 0.0009, -2.4900, 4.8045},
                                           {50, -0.0010, 2.4900, 50, 0.0010, -2.4900, 4.8045},
                                           {50, -0.0010, 2.4900, 50, 0.0011, -2.4900, 4.7461},
                                           {50, 2.5, 0, 50, 0, -2.5, 4.3065},
                                           {50, 2.5, 0, 73, 25, -18, 27.1492},
                                           {50, 2.5, 0, 61, -5, 29, 22.8977},
                                           {50, 2.5, 0, 56, -27, -3, 31.9030},
                                           {50, 2.5, 0, 58, 24, 15, 19.4535},
                                           {50, 2.5, 0, 50, 3.1736, 0.5854, 1.0000},
                                           {50, 2.5, 0, 50, 3.2972, 0, 1.0000},
                                           {50, 2.5, 0, 50, 1.8634, 0.5757, 1.0000},
                                           {50, 2.5, 0, 50, 3.2592, 0.3350, 1.0000},
                                           {60.2574, -34.0099, 36.2677, 60.4626, -34.1751, 39.4387, 1.2644},
                                           {63.0109, -31.0961, -5.8663, 62.8187, -29.7946, -4.0864, 1.2630},
                                           {61.2901, 3.7196, -5.3901, 61.4292, 2.2480, -4.9620, 1.8731},
                                           {35.0831, -44.1164, 3.7933, 35.0232, -40.0716, 1.5901, 1.8645},
                                           {22.7233, 20.0904, -46.6940, 23.0331, 14.9730, -42.5619, 2.0373},
                                           {36.4612, 47.8580, 18.3852, 36.2715, 50.5065, 21.2231, 1.4146},
                                           {90.8027, -2.0831, 1.4410, 91.1528, -1.6435, 0.0447, 1.4441},
                                           {90.9257, -0.5406, -0.9208, 88.6381, -0.8985, -0.7239, 1.5381},
                                           {6.7747, -0.2908, -2.4247, 5.8714, -0.0985, -2.2286, 0.6377},
                                           {2.0776, 0.0795, -1.1350, 0.9033, -0.0636, -0.5514, 0.9082}};
  for (const auto& p : kPairs) {
    const glm::dvec3 a(p[0], p[1], p[2]), b(p[3], p[4], p[5]);
    EXPECT_NEAR(Ciede2000(a, b), p[6], 5e-5);
    EXPECT_NEAR(Ciede2000(b, a), p[6], 5e-5);
  }
}

TEST(Colour, WhiteIsTheReferenceWhiteAndGreyHasNoChroma) {
  const glm::dvec3 white = LabFromLinearRgb(glm::dvec3(1.0)), grey = LabFromLinearRgb(glm::dvec3(0.18));
  EXPECT_NEAR(white.x, 100.0, 1e-4);
  EXPECT_NEAR(grey.x, 49.4961, 1e-3);  // CIE: 116 cbrt(0.18) - 16
  for (double v : {white.y, white.z, grey.y, grey.z}) EXPECT_NEAR(v, 0.0, 0.01);
}

TEST(Colour, EqualPicturesHaveZeroDifferenceAtAnyExposure) {
  Image a(32, 16, 3);
  for (size_t i = 0; i < a.values.size(); ++i) a.values[i] = 0.1f + 0.5f * static_cast<float>(i % 17) / 17.0f;
  const ColourDifference d = ComparePictures(a, a, std::vector<uint8_t>(32 * 16, 1));
  EXPECT_EQ(d.median, 0.0);
  EXPECT_EQ(d.share_below_pt, 1.0);
  EXPECT_EQ(d.blocks, 8u);
  EXPECT_NEAR(ComparisonScale(Image(4, 4, 3, 0.3f), std::vector<uint8_t>(16, 1), {}), 2.0, 1e-6);
}

TEST(Colour, BlocksAverageNoiseAndPixelsDoNot) {
  Image a(64, 64, 3, 0.5f), b = a;
  for (size_t i = 0; i < b.values.size(); ++i) b.values[i] += (i / 3 + i / 192) % 2 ? 0.02f : -0.02f;  // chequerboard
  const ColourDifference d = ComparePictures(a, b, std::vector<uint8_t>(64 * 64, 1));
  EXPECT_LT(d.median, 0.01);
  EXPECT_GT(d.pixel_median, 0.5);
}

TEST(Colour, OnlyRedGreenBlueInThisOrderAreAccepted) {
  EXPECT_TRUE(AreRedGreenBlue(std::array{600.0, 540.0, 450.0}));
  EXPECT_TRUE(AreRedGreenBlue(std::array{610.0, 560.0, 465.0}));
  EXPECT_FALSE(AreRedGreenBlue(std::array{540.0, 600.0, 450.0}));
  EXPECT_FALSE(AreRedGreenBlue(std::array{940.0, 850.0, 705.0}));
  EXPECT_FALSE(AreRedGreenBlue(std::array{540.0, 540.0, 540.0}));
}

}  // namespace
}  // namespace crownfit
