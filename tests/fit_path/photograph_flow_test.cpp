// Derivatives by errors of pose from a photograph's own gradient, against photographs whose change is known.

#include "fit_path/photograph_flow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "base/random.h"
#include "capture/capture.h"
#include "fit/calibration_derivatives.h"
#include "fit/choose_pixels.h"
#include "fit/compare_photographs.h"
#include "scene/cast_capture.h"
#include "shader/predict.h"
#include "support/channels.h"
#include "support/synthetic_capture.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

/// Per pixel of a cast.
using Picture = std::vector<Spectrum>;

/// The front photograph of an incisor whose pose may be wrong by 0.15 mm.
class PhotographFlow : public testing::Test {
 protected:
  PhotographFlow() {
    WriteSyntheticCapture(folder_.path, {.pixels = 80, .levels = 20, .initial_factor = 1.0});
    capture_ = ReadCapture(folder_.path);
    std::erase_if(capture_.photographs, [](const PhotographSpec& p) { return p.name != "front"; });
    std::array<double, 36> covariance{};
    covariance[21] = covariance[28] = 0.15 * 0.15;
    capture_.photographs[0].pose_covariance = covariance;
    free_ = FreeParametersOf(capture_);
    errors_ = StatedErrors(capture_);
    input_ = ReadInput(capture_, 0, false);
    at_.x = StartVector(free_);
    at_.scales.light = StatedLightScales(capture_);
    at_.calibration.amounts.assign(errors_.size(), 0.0);
    at_.cast = CastIn(capture_);
  }

  CastState CastIn(const Capture& capture) {
    CrownInput moved = input_;
    moved.capture = capture;
    return CastAll(moved, ThicknessesOf(capture, MaterialAt(free_, at_.x)), {}, silent_);
  }

  Picture Shaded() const { return PredictPixels(capture_, at_.cast, 0, MaterialAt(free_, at_.x), at_.scales.light, 0); }

  /// As if this had been photographed; with derivatives by shader.
  void Photographed(const Picture& picture, float variance) {
    const Camera& camera = capture_.photographs[0].camera;
    Photograph photo;
    photo.linear = Image(camera.width, camera.height, kChannels);
    photo.variance = Image(camera.width, camera.height, kChannels, variance);
    photo.usable.assign(static_cast<size_t>(camera.width) * camera.height, 1);
    for (size_t k = 0; k < picture.size(); ++k)
      for (int c = 0; c < kChannels; ++c)
        photo.linear.at(at_.cast.photographs[0].pixels[k].x, at_.cast.photographs[0].pixels[k].y, c) =
            static_cast<float>(picture[k][c]);
    input_.photographs = {photo};
    at_.pixels = ChoosePixels(input_, at_.cast, 100000);
    at_.calibration.derivatives =
        CalibrationDerivativesOf(input_, capture_, errors_, at_.calibration.amounts, at_.cast, MaterialAt(free_, at_.x),
                                 at_.scales.light, {}, at_.pixels, silent_);
  }

  void TakeGradients(const KnownPicture& walked = {}) {
    TakeOwnGradients({capture_, free_, errors_, options_}, input_, 0, walked, at_);
  }

  /// Rows of those of the fit's pixels around which all others within 4 are the fit's too.
  std::vector<int> RowsAmidOthers() const {
    constexpr int kReach = 4;
    const std::vector<PixelCast>& cast = at_.cast.photographs[0].pixels;
    const std::vector<int>& pixels = at_.pixels[0].pixels;
    std::set<std::pair<int, int>> places;
    for (const int k : pixels) places.emplace(cast[k].x, cast[k].y);
    std::vector<int> rows;
    for (size_t i = 0; i < pixels.size(); ++i) {
      bool is_amid = true;
      for (int y = -kReach; y <= kReach; ++y)
        for (int x = -kReach; x <= kReach; ++x)
          is_amid = is_amid && places.contains({cast[pixels[i]].x + x, cast[pixels[i]].y + y});
      for (int c = 0; c < kChannels && is_amid; ++c) rows.push_back(kChannels * static_cast<int>(i) + c);
    }
    return rows;
  }

  TemporaryFolder folder_;
  Capture capture_;
  FreeParameters free_;
  std::vector<CalibrationError> errors_;
  CrownInput input_;
  FitState at_;
  FitOptions options_;
  Progress silent_{ProgressMode::kNone};
};

TEST_F(PhotographFlow, LeavesShadersSlopesWhereThePhotographIsItsPicture) {
  Photographed(Shaded(), 1e-12f);
  const Eigen::MatrixXd before = at_.calibration.derivatives[0].by_error;
  TakeGradients();
  const CalibrationDerivatives& after = at_.calibration.derivatives[0];
  EXPECT_GT(after.of_photograph.norm(), 0.3 * before.norm());
  EXPECT_LT((after.of_photograph - after.of_shader).norm(), 1e-3 * before.norm());
  EXPECT_EQ(after.by_error, before);
}

TEST_F(PhotographFlow, LeavesShadersSlopesWhereThePhotographIsNoise) {
  Photographed(Shaded(), 1e6f);
  const Eigen::MatrixXd before = at_.calibration.derivatives[0].by_error;
  TakeGradients();
  EXPECT_EQ(at_.calibration.derivatives[0].of_photograph.norm(), 0.0);
  EXPECT_EQ(at_.calibration.derivatives[0].of_shader.norm(), 0.0);
  EXPECT_EQ(at_.calibration.derivatives[0].by_error, before);
}

TEST_F(PhotographFlow, IsThatOfWalksWhereThePhotographIsNoise) {
  const Picture shaded = Shaded();
  Photographed(shaded, 1e-12f);
  TakeGradients();
  const Eigen::MatrixXd sharp = at_.calibration.derivatives[0].of_photograph;
  Picture noisy = shaded;
  const auto noise = [&](size_t k, uint64_t c) {
    return 0.3 * shaded[k][static_cast<int>(c)] * Gaussian(Key(7, c), k);
  };
  for (size_t k = 0; k < noisy.size(); ++k) noisy[k] += Spectrum{noise(k, 0), noise(k, 1), noise(k, 2)};
  Photographed(noisy, 0.01f);
  KnownPicture walked;
  for (const int k : at_.pixels[0].pixels) {
    walked.values.push_back(shaded[k]);
    walked.variances.emplace_back(kChannels, 1e-6);
  }
  // Over the rim the photograph shows more of a pixel's neighbourhood than walks know.
  const std::vector<int> inside = RowsAmidOthers();
  const auto off = [&] {
    return (at_.calibration.derivatives[0].of_photograph - sharp)(inside, Eigen::all).norm() /
           sharp(inside, Eigen::all).norm();
  };
  TakeGradients();
  EXPECT_GT(off(), 0.5);
  TakeGradients(walked);
  EXPECT_LT(off(), 0.01);
}

TEST_F(PhotographFlow, OfAPaintedToothIsThePaintsOwn) {
  const auto painted = [&](const CastState& cast) {
    Picture picture;
    for (const PixelCast& pixel : cast.photographs[0].pixels) {
      glm::dvec3 point(0.0);
      for (int k = 0; k < 3 && pixel.at.exists(); ++k)
        point += static_cast<double>(pixel.at.weights[k]) * cast.crown->fine.vertices[pixel.at.vertices[k]];
      picture.push_back({1.0 + 0.5 * std::sin(2.0 * point.x), 1.0 + 0.5 * std::sin(2.0 * point.y),
                         1.0 + 0.5 * std::sin(point.x + point.y)});
    }
    return picture;
  };
  const Picture paint = painted(at_.cast);
  Photographed(paint, 1e-12f);
  const FitPixels p = at_.pixels[0];
  TakeGradients();
  const Eigen::MatrixXd of_photograph = at_.calibration.derivatives[0].of_photograph;
  KnownPicture walked;
  for (const int k : p.pixels) {
    walked.values.push_back(paint[k]);
    walked.variances.emplace_back(kChannels, 1e-12);
  }
  Photographed(paint, 1e6f);  // tells nothing
  ASSERT_EQ(at_.pixels[0].pixels, p.pixels);
  TakeGradients(walked);
  const Eigen::MatrixXd of_walks = at_.calibration.derivatives[0].of_photograph;
  for (size_t e = 0; e < errors_.size(); ++e) {
    std::vector<Picture> there;
    std::vector<std::vector<int>> index;
    for (const double side : {-0.5, 0.5}) {
      std::vector<double> amounts(errors_.size(), 0.0);
      amounts[e] = side;
      const CastState cast = CastIn(Moved(capture_, errors_, amounts));
      there.push_back(painted(cast));
      std::vector<int> at(80 * 80, -1);
      for (size_t k = 0; k < cast.photographs[0].pixels.size(); ++k)
        at[static_cast<size_t>(cast.photographs[0].pixels[k].y) * 80 + cast.photographs[0].pixels[k].x] =
            static_cast<int>(k);
      index.push_back(at);
    }
    double off = 0, off_by_walks = 0, size = 0;
    for (size_t i = 0; i < p.pixels.size(); ++i) {
      const PixelCast& pixel = at_.cast.photographs[0].pixels[p.pixels[i]];
      const size_t place = static_cast<size_t>(pixel.y) * 80 + pixel.x;
      for (int c = 0; c < kChannels; ++c) {
        const double change = there[1][index[1][place]][c] - there[0][index[0][place]][c];
        const auto row = kChannels * static_cast<Eigen::Index>(i) + c;
        off += std::pow(of_photograph(row, static_cast<int>(e)) - change, 2), size += change * change;
        off_by_walks += std::pow(of_walks(row, static_cast<int>(e)) - change, 2);
      }
    }
    EXPECT_LT(std::sqrt(off / size), 0.095) << errors_[e].what;
    EXPECT_LT(std::sqrt(off_by_walks / size), 0.1) << errors_[e].what;
  }
}

}  // namespace
}  // namespace crownfit
