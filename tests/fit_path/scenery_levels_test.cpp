// What tiles and scenery beside the object say of the lamps and exposures that a capture states.

#include "fit_path/scenery_levels.h"

#include <gtest/gtest.h>

#include "capture/capture.h"
#include "path/path_derivatives.h"
#include "path/path_photograph.h"
#include "scene/cast_capture.h"
#include "support/channels.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// An incisor at its true values before tiles and a blade, photographed by walks.
class BesideAnIncisor : public testing::Test {
 protected:
  BesideAnIncisor() {
    WriteSyntheticCapture(folder_.path, {.pixels = 48, .levels = 14, .size = 0.5, .initial_factor = 1.0});
    capture_ = ReadCapture(folder_.path);
    free_ = FreeParametersOf(capture_);
    input_ = ReadInput(capture_, 0, false);
    at_.x = StartVector(free_);
    at_.scales.light.assign(capture_.lights.size(), 1.0);
    const Material material = MaterialAt(free_, at_.x);
    Progress silent(ProgressMode::kNone);
    at_.cast = CastAll(input_, ThicknessesOf(capture_, material), {}, silent);
    Bodies bodies(input_, 0);
    for (size_t i = 0; i < capture_.photographs.size(); ++i) {
      const PathPhotograph walked = RenderByPaths(capture_, bodies.Of(material), input_.scenery, material, i,
                                                  {.paths_per_pixel = 64, .seed = 5}, [](double) {});
      Photograph photo;
      photo.linear = Image(walked.width, walked.height, kChannels);
      for (size_t k = 0; k < walked.pixels.size(); ++k)
        for (int c = 0; c < kChannels; ++c)
          photo.linear.values[kChannels * walked.rendered[k] + c] = static_cast<float>(walked.pixels[k].mean[c]);
      photo.usable.assign(walked.pixels.size(), 1);
      input_.photographs.push_back(std::move(photo));
      results_.emplace_back().name = capture_.photographs[i].name;
    }
  }

  std::vector<SceneryLevel> Levels() {
    Progress silent(ProgressMode::kNone);
    return SceneryLevelsOf({capture_, free_, errors_, options_}, input_, at_, results_, silent);
  }

  TemporaryFolder folder_;
  Capture capture_;
  FreeParameters free_;
  std::vector<CalibrationError> errors_;
  FitOptions options_;
  CrownInput input_;
  FitState at_;
  std::vector<PhotographResult> results_;
};

TEST_F(BesideAnIncisor, IsAsBrightAsStatedAndAsMuchBrighterAsItWasExposed) {
  const std::vector<SceneryLevel> as_stated = Levels();
  ASSERT_GE(as_stated.size(), 3);
  for (const SceneryLevel& level : as_stated)
    for (const double ratio : level.ratio) EXPECT_NEAR(ratio, 1.0, 0.02) << level.photograph;
  for (Photograph& photo : input_.photographs)
    for (size_t k = 0; k < photo.linear.values.size(); ++k) photo.linear.values[k] *= k % kChannels == 2 ? 0.8f : 1.1f;
  for (const SceneryLevel& level : Levels()) {
    EXPECT_NEAR(level.ratio[0], 1.1, 0.022) << level.photograph;
    EXPECT_NEAR(level.ratio[2], 0.8, 0.016) << level.photograph;
  }
}

TEST_F(BesideAnIncisor, SaysNothingWhereItWasMaskedOrCutOut) {
  for (size_t i = 0; i < input_.photographs.size(); ++i) {
    Photograph& photo = input_.photographs[i];
    std::vector<uint8_t> shows(photo.usable.size(), 0);
    for (const PixelCast& p : at_.cast.photographs[i].pixels)
      shows[static_cast<size_t>(p.y) * photo.linear.width + p.x] = 1;
    if (i % 2 == 0) photo.usable = shows;
    for (size_t k = 0; k < photo.linear.values.size(); ++k)
      if (!shows[k / kChannels]) photo.linear.values[k] = 0.0f;
  }
  EXPECT_TRUE(Levels().empty());
}

}  // namespace
}  // namespace crownfit
