#include "capture/camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

Camera Wide(const std::array<double, 8>& distortion) { return {48, 48, 48, 48, 24, 24, distortion}; }

TEST(Distortion, FoldsWhereTheRadialPolynomialTurns) {
  // r (1 + k r^2) turns at r^2 = -1 / (3 k), where it is 2/3 of that r; the picture's corner lies at 0.7071.
  for (const double k : {-1.0, -2.0}) {
    const auto radius = FoldRadius_px(Wide({k}));
    ASSERT_TRUE(radius);
    EXPECT_NEAR(*radius, 48 * 2.0 / 3.0 * std::sqrt(-1 / (3 * k)), 0.1);
  }
  EXPECT_FALSE(FoldRadius_px(Wide({})));
  EXPECT_FALSE(FoldRadius_px(Wide({-0.25}))) << "turns at 0.77, beyond the corner";
  EXPECT_FALSE(FoldRadius_px(Wide({0.3, -0.05, 1e-3, -1e-3})));
}

TEST(Distortion, OfACameraFileMustBeOneToOne) {
  const TemporaryFolder folder;
  WriteTextFile(folder.path / "c.json",
                R"({"format": "crownfit-camera/1", "width": 48, "height": 48, "fx": 48, "fy": 48, "cx": 24, "cy": 24,
                    "distortion": [-1, 0, 0, 0]})");
  try {
    ReadCamera(folder.path / "c.json");
    FAIL() << "a camera that folds was read";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("folds back 18.5 px"), std::string::npos) << e.what();
  }
}

TEST(Distortion, InverseStaysBeforeThePole) {
  const Camera camera = Wide({0, 0, 0, 0, 0, -4.0});  // r / (1 - 4 r^2): all radii belong to r below 0.5
  for (double x = 0.5; x < 48; x += 3)
    for (double y = 0.5; y < 48; y += 3) {
      const glm::dvec3 d = DirectionFromPixel(camera, {x, y});
      const double wanted = std::hypot(x - 24, y - 24) / 48, r = std::hypot(d.x, d.y) / d.z;
      EXPECT_NEAR(r, wanted > 0 ? (std::sqrt(1 + 16 * wanted * wanted) - 1) / (8 * wanted) : 0.0, 1e-7)
          << x << " " << y;
      const auto back = PixelFromPoint(camera, 100.0 * d);
      ASSERT_TRUE(back);
      EXPECT_NEAR(glm::distance(*back, {x, y}), 0.0, 1e-6);
    }
}

}  // namespace
}  // namespace crownfit
