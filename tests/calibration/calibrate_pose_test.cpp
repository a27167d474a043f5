// Poses: from markers around a crown.

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "calibration/estimate_pose.h"
#include "support/rendered_target.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

const Camera kCamera{.width = 640,
                     .height = 520,
                     .fx = 3000,
                     .fy = 3000,
                     .cx = 318,
                     .cy = 262,
                     .distortion = {-0.1, 0, 0.001, 0, 0, 0, 0, 0}};

ImageFile JigPhotograph(const RigidTransform& pose, uint64_t seed) {
  ImageFile file;
  const PrintedTarget print = PrintedJig({});
  const glm::dvec2 middle(0.5 * print.size_mm.x, 0.5 * print.size_mm.x);
  file.image = RenderTarget(print, middle, kCamera, pose, {.level = 0.7, .seed = seed});
  return file;
}

/// The small rotation vector and shift, in the camera frame, that take one pose to another.
std::array<double, 6> Between(const RigidTransform& from, const RigidTransform& to) {
  const glm::dmat3 r = to.rotation * glm::transpose(from.rotation);
  const glm::dvec3 w = 0.5 * glm::dvec3(r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]);
  const glm::dvec3 t = to.translation_mm - r * from.translation_mm;
  return {w.x, w.y, w.z, t.x, t.y, t.z};
}

TEST(CalibratePose, JigMarkersRecoverPoseWithinStandardDeviations) {
  const Jig jig = JigOf({});
  double squares = 0;
  constexpr int kTrials = 6;
  for (int i = 0; i < kTrials; ++i) {
    const RigidTransform truth = LookingAt({1, -1, 0}, 240 + 10 * i, 8 + 6 * i, 60 * i, 13 * i);
    const BoardView view = FindJig(JigPhotograph(truth, i + 1), jig);
    EXPECT_GE(view.pixel.size(), 40u);
    const auto pose = EstimatePose(view, kCamera);
    ASSERT_TRUE(pose);
    EXPECT_LT(pose->rms_px, 0.25);
    const auto error = Between(pose->camera_from_board, truth);
    for (int k = 0; k < 6; ++k) {
      const double z = error[k] / std::sqrt(pose->covariance[7 * k]);
      EXPECT_LT(std::abs(z), 5.0) << "trial " << i << " component " << k;
      squares += z * z / (6.0 * kTrials);
    }
  }
  EXPECT_GT(std::sqrt(squares), 0.3);
  EXPECT_LT(std::sqrt(squares), 2.0);
}

TEST(CalibratePose, MisplacedMarkerIsExcluded) {
  const RigidTransform truth = LookingAt({0, 0, 0}, 260, 15, 40, 0);
  BoardView view = FindJig(JigPhotograph(truth, 1), JigOf({}));
  for (int k = 0; k < 4; ++k) view.pixel[k] += glm::dvec2(40, -25);
  const auto pose = EstimatePose(view, kCamera);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->left_out, 4u);
  EXPECT_LT(pose->rms_px, 0.3);
}

TEST(CalibratePose, AMarkerThatAJigListsTwiceIsRefused) {
  const TemporaryFolder folder;
  const std::filesystem::path file = folder.path / "jig.json";
  const Jig good = JigOf({});
  WriteTextFile(file, ToJsonText(JigJson(good)));
  EXPECT_EQ(ReadJig(file).ids, good.ids);
  Jig twice = good;
  twice.ids.push_back(good.ids[1]);
  twice.corners_mm.push_back(good.corners_mm[0]);
  WriteTextFile(file, ToJsonText(JigJson(twice)));
  try {
    ReadJig(file);
    FAIL() << "a marker has two places";
  } catch (const InputError& error) {
    const std::string key = "markers[" + std::to_string(good.ids.size()) + "].id";
    EXPECT_NE(std::string(error.what()).find(key + ": marker " + std::to_string(good.ids[1]) + " occurs twice"),
              std::string::npos)
        << error.what();
  }
}

TEST(CalibratePose, TooFewMarkersAreRefused) {
  const RigidTransform truth = LookingAt({0, 0, 0}, 260, 15, 40, 0);
  const ImageFile photo = JigPhotograph(truth, 1);
  BoardView view = FindJig(photo, JigOf({}));
  view.pixel.resize(4);
  view.board_mm.resize(4);
  const Product product = MarkerPosesProduct({{"front", &photo.image, view}}, kCamera);
  ASSERT_EQ(product.refusals.size(), 1u);
  EXPECT_NE(product.refusals[0].find("front: shows 4 corners"), std::string::npos) << product.refusals[0];
}

TEST(CalibratePose, AWrongCameraIsRefused) {
  Camera wrong = kCamera;  // for an image of half the size
  wrong.fx = wrong.fy = 1500;
  wrong.cx = 160;
  wrong.cy = 130;
  const ImageFile photo = JigPhotograph(LookingAt({0, 0, 0}, 260, 45, 40, 0), 1);
  const Product product = MarkerPosesProduct({{"front", &photo.image, FindJig(photo, JigOf({}))}}, wrong);
  ASSERT_FALSE(product.refusals.empty());
  EXPECT_NE(product.refusals[0].find("camera file"), std::string::npos) << product.refusals[0];
}

}  // namespace
}  // namespace crownfit
