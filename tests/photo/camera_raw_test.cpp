// RAW files of cameras: values against the file's own counts, and against dcraw.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "photo/image_io.h"
#include "support/dng.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

TEST(CameraRaw, CountsComeOutLinearWithBlackRemovedAndWhiteBalanceAsShot) {
  const TemporaryFolder folder;
  Dng dng;
  dng.counts = [](int x, int y) {  // a flat field: R, G, B = 4000, 8000, 6000 counts above black
    return static_cast<uint16_t>(2048 + (y % 2 == 0 ? (x % 2 == 0 ? 4000 : 8000) : (x % 2 == 0 ? 8000 : 6000)));
  };
  WriteDng(folder.path / "flat.dng", dng);
  const ImageFile read = ReadImageFile(folder.path / "flat.dng");
  ASSERT_EQ(read.image.channels, 3);
  EXPECT_FALSE(read.transfer.is_encoded());
  ASSERT_TRUE(read.white_balance);
  EXPECT_NEAR((*read.white_balance)[0], 2.0, 1e-3);
  EXPECT_NEAR((*read.white_balance)[2], 1.25, 1e-3);
  const double range = 15000 - 2048;
  EXPECT_NEAR(read.image.at(20, 20, 0), 4000 * 2.0 / range, 2e-4);
  EXPECT_NEAR(read.image.at(20, 20, 1), 8000 / range, 2e-4);
  EXPECT_NEAR(read.image.at(20, 20, 2), 6000 * 1.25 / range, 2e-4);
}

TEST(CameraRaw, EachPlaceOfTheMosaicHasItsOwnBlackLevel) {
  const TemporaryFolder folder;
  Dng dng{.black = {100, 900, 500, 300}, .white = 4095, .counts = {}};
  const double share[4] = {0.2, 0.3, 0.3, 0.25};  // of white above black
  dng.counts = [&](int x, int y) {
    const int place = 2 * (y % 2) + x % 2;
    return static_cast<uint16_t>(std::lround(dng.black[place] + share[place] * (dng.white - dng.black[place])));
  };
  WriteDng(folder.path / "levels.dng", dng);
  const Image image = ReadImageFile(folder.path / "levels.dng").image;
  EXPECT_NEAR(image.at(20, 20, 0), 0.2 * 2.0, 4e-4);
  EXPECT_NEAR(image.at(20, 20, 1), 0.3, 4e-4);
  EXPECT_NEAR(image.at(20, 20, 2), 0.25 * 1.25, 4e-4);
}

TEST(CameraRaw, DemosaicedFilesAreScaledByWhiteLessBlackToo) {
  const TemporaryFolder folder;
  Dng dng{.black = {528, 528, 528, 528}, .white = 4095, .is_mosaic = false, .counts = {}};
  for (const double share : {0.25, 0.8}) {
    dng.counts = [&](int, int) { return static_cast<uint16_t>(std::lround(528 + share * (4095 - 528))); };
    WriteDng(folder.path / "linear.dng", dng);
    const ImageFile read = ReadImageFile(folder.path / "linear.dng");
    EXPECT_NEAR(read.image.at(20, 20, 1), share, 5e-4);
    if (share < 0.5) {  // beyond, red is saturated
      EXPECT_NEAR(read.image.at(20, 20, 0), 2.0 * share, 1e-3);
    }
  }
}

TEST(CameraRaw, BrightnessDoesNotDependOnOtherPixels) {
  const TemporaryFolder folder;
  const auto corner = [&](int bright) {
    Dng dng;
    dng.counts = [&](int x, int) { return static_cast<uint16_t>(x > 30 ? bright : 5000); };
    WriteDng(folder.path / "p.dng", dng);
    return ReadImageFile(folder.path / "p.dng").image.at(8, 8, 1);
  };
  EXPECT_EQ(corner(5000), corner(14000));
}

TEST(CameraRaw, PhotographOfACanonAgreesWithDcraw) {
  const char* reference = std::getenv("CROWNFIT_REFERENCE");
  const auto folder = std::filesystem::path(reference ? reference : "") / "data/real/colorchecker-passport-dng";
  if (!reference || !std::filesystem::exists(folder)) GTEST_SKIP() << "no $CROWNFIT_REFERENCE with this photograph";
  // dcraw's image is half as large (a pixel from each 2 x 2), with black removed and without white balance.
  const ImageFile ours = ReadImageFile(folder / "colorchart.dng");
  const Image dcraw = ReadImageFile(folder / "colorchart_linear_camrgb_half16.tiff").image;
  ASSERT_EQ(ours.image.width, 2 * dcraw.width);
  ASSERT_TRUE(ours.white_balance);
  EXPECT_NEAR((*ours.white_balance)[0], 2.477, 1e-3);  // the file's AsShotNeutral
  EXPECT_NEAR((*ours.white_balance)[2], 2.477 / 1.462, 1e-3);
  // A block's share of an edge differs by half a pixel, since dcraw takes red and blue at the filters' positions.
  const int block = 34;  // pixels of dcraw's picture
  double difference = 0, light = 0;
  for (int c = 0; c < 3; ++c)
    for (int y = 0; y + block <= dcraw.height; y += block)
      for (int x = 0; x + block <= dcraw.width; x += block) {
        double a = 0, b = 0;
        for (int j = 0; j < block; ++j)
          for (int i = 0; i < block; ++i) {
            b += dcraw.at(x + i, y + j, c) * (*ours.white_balance)[c] / (block * block);
            for (int k = 0; k < 4; ++k)
              a += ours.image.at(2 * (x + i) + k % 2, 2 * (y + j) + k / 2, c) / (4 * block * block);
          }
        difference += std::abs(a - b);
        light += b;
      }
  EXPECT_LT(difference / light, 0.005);
}

}  // namespace
}  // namespace crownfit
