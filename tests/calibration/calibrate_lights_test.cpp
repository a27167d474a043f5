// Lamps from mirror balls and cards: known ones recovered, published ones reproduced.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>

#include "base/error.h"
#include "base/files.h"
#include "calibration/ball_lights.h"
#include "calibration/estimate_lights.h"
#include "photo/photograph.h"
#include "scene/light_samples.h"
#include "support/real_data.h"
#include "support/rendered_target.h"
#include "support/temporary_folder.h"

namespace crownfit {
namespace {

const Camera kCamera{.width = 640,
                     .height = 480,
                     .fx = 2600,
                     .fy = 2600,
                     .cx = 320,
                     .cy = 240,
                     .distortion = {-0.05, 0, 0, 0, 0, 0, 0, 0}};

/// Mirror balls on grey, each with the image of a small spherical lamp.
Image BallPhotograph(const std::vector<glm::dvec3>& centres_mm, double radius_mm, const glm::dvec3& lamp_mm,
                     double lamp_radius_mm) {
  Image image(kCamera.width, kCamera.height, 1);
  constexpr int kStrata = 3;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double sum = 0;
      for (int s = 0; s < kStrata * kStrata; ++s) {
        const glm::dvec3 d =
            DirectionFromPixel(kCamera, {x + (s % kStrata + 0.5) / kStrata, y + (s / kStrata + 0.5) / kStrata});
        double value = 0.25;  // the wall behind
        for (const glm::dvec3& centre : centres_mm) {
          const double along = glm::dot(centre, d),
                       q = along * along - glm::dot(centre, centre) + radius_mm * radius_mm;
          if (q <= 0) continue;
          const glm::dvec3 at = (along - std::sqrt(q)) * d, n = (at - centre) / radius_mm,
                           r = d - 2 * glm::dot(d, n) * n;
          const glm::dvec3 to = lamp_mm - at;
          value = glm::length(glm::cross(r, to)) < lamp_radius_mm && glm::dot(r, to) > 0
                      ? 5.0
                      : 0.03 + 0.02 * std::max(0.0, -r.y);
        }
        sum += value / (kStrata * kStrata);
      }
      image.at(x, y, 0) = static_cast<float>(std::min(sum, 1.0));
    }
  return Noisy(Blurred(image, 0.6), 2e-5, 1e-3, 5);
}

std::vector<LampRay> Rays(const Image& image, int balls) {
  ImageFile photo;
  photo.image = image;
  std::vector<LampRay> rays;
  for (const BallOutline& ball : FindBalls(photo, balls)) {
    const auto highlight = FindHighlight(image, ball);
    if (!highlight) continue;
    if (const auto ray = RayTowardsLamp(ball, *highlight, &kCamera, 6.0)) rays.push_back(*ray);
  }
  return rays;
}

TEST(CalibrateLights, OneBallGivesTheDirectionOfALamp) {
  for (const glm::dvec3 lamp : {glm::dvec3(-200, -150, 20), glm::dvec3(150, -50, -100), glm::dvec3(0, 200, 150)}) {
    const glm::dvec3 centre(3, -2, 250);
    const auto rays = Rays(BallPhotograph({centre}, 6.0, lamp, 12.0), 1);
    ASSERT_EQ(rays.size(), 1u);
    const double error = std::acos(std::min(1.0, glm::dot(rays[0].direction, glm::normalize(lamp - rays[0].from_mm))));
    EXPECT_LT(error, 3 * rays[0].stddev_rad);
    EXPECT_LT(error, 0.02);
    EXPECT_NEAR(glm::length(rays[0].from_mm - centre), 6.0, 1.5) << "the ball stands where its outline appears";
  }
}

TEST(CalibrateLights, TwoBallsGiveThePositionOfANearLamp) {
  const glm::dvec3 lamp(-120, -90, 60);
  const auto rays = Rays(BallPhotograph({{-18, 4, 250}, {20, -6, 260}}, 6.0, lamp, 6.0), 2);
  ASSERT_EQ(rays.size(), 2u);
  const auto found = Triangulate(rays);
  ASSERT_TRUE(found);
  const glm::dvec3 error = found->position_mm - lamp;
  const double sigma2 = glm::dot(error, glm::inverse(found->covariance_mm2) * error);
  EXPECT_LT(sigma2, 14.2) << "three degrees of freedom, 99.7 %";
  EXPECT_LT(glm::length(error), 25.0);
}

TEST(CalibrateLights, InconsistentBallsWidenTheDirectionAndWarn) {
  const std::vector<glm::dvec3> balls{{-18, 4, 250}, {20, -6, 260}};
  const Image one = BallPhotograph(balls, 6.0, {-200, -150, 20}, 12.0);
  Image both = BallPhotograph(balls, 6.0, {150, -50, -100}, 12.0);
  for (int y = 0; y < both.height; ++y)
    for (int x = 0; x < both.width / 2; ++x) both.at(x, y, 0) = one.at(x, y, 0);
  const auto direction = [&](const Image& image, std::vector<std::string>& notes) {
    ImageFile photo;
    photo.image = image;
    return LightsFromBalls({{"lamp", &image, FindBalls(photo, 2)}}, nullptr, 6.0, notes).at(0);
  };
  std::vector<std::string> quiet, loud;
  EXPECT_LT(direction(one, quiet).stddev_deg, 3.0);
  EXPECT_GT(direction(both, loud).stddev_deg, 5.0) << "40 degrees between the two";
  EXPECT_EQ(loud.size(), 1u);
}

TEST(CalibrateLights, ParallelRaysGiveNoPosition) {
  const glm::dvec3 direction = glm::normalize(glm::dvec3(-1, -1, -1));
  EXPECT_FALSE(Triangulate({{{0, 0, 250}, direction, 0.005}, {{0, 0, 250}, direction, 0.005}}));
}

/// A uniform card of reflectance 0.5 under a lamp; it fills the image.
Image CardPicture(const LightShape& lamp, const RigidTransform& camera_from_card, uint64_t seed) {
  Image image(kCamera.width, kCamera.height, 3);
  const RigidTransform card_from_camera = camera_from_card.Inverse();
  for (int y = 0; y < image.height; y += 4)
    for (int x = 0; x < image.width; x += 4) {
      const glm::dvec3 d = DirectionFromPixel(kCamera, {x + 2.0, y + 2.0});
      const double t = -card_from_camera.translation_mm.z / card_from_camera.Direction(d).z;
      std::vector<LightSample> samples;
      const glm::dvec3 normal = camera_from_card.Direction({0, 0, -1});
      SampleLight(lamp, t * d, normal, 6, samples);
      Spectrum sum;
      for (const auto& s : samples) sum += s.weight * std::max(0.0, glm::dot(s.direction, normal));
      for (int v = y; v < y + 4; ++v)
        for (int u = x; u < x + 4; ++u)
          for (int c = 0; c < 3; ++c) image.at(u, v, c) = static_cast<float>(0.5 * sum[c]);
    }
  return Noisy(image, 2e-5, 5e-4, seed);
}

CardPhotograph Card(const Image& image, const RigidTransform& pose) {
  return {"lamp", &image, kCamera, pose, {-25, -18}, {25, 18}, glm::dvec3(0.5), glm::dvec3(2.0)};
}

TEST(CalibrateLights, ACardGivesIntensityAndColour) {
  const PointLight truth{{-120, -90, 60}, {30000, 25000, 18000}, 2.0};
  const RigidTransform pose = LookingAt({0, 0, 0}, 250, 20, 30, 0);
  const Image image = CardPicture(truth, pose, 3);
  const CardPhotograph card = Card(image, pose);
  Light start;
  start.name = "lamp";
  start.shape = PointLight{truth.position_mm, glm::dvec3(1000.0), 2.0};
  const auto fit = FitCards(start, {&card}, false);
  ASSERT_TRUE(fit);
  EXPECT_LT(fit->rms, 0.01);
  const auto& found = std::get<PointLight>(fit->light.shape);
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(found.radiant_intensity[c] / truth.radiant_intensity[c], 1.0, 3 * fit->stddev[c] + 1e-3);
}

TEST(CalibrateLights, PositionCovarianceRoundTrips) {
  TemporaryFolder folder;
  const auto rig = [&](const JsonValue& lights) {
    WriteTextFile(folder.path / "rig.json",
                  ToJsonText(JsonValue::Object{{"format", "crownfit-light-rig/1"}, {"lights", lights}}));
    return ReadLightRig(folder.path / "rig.json").lights[0];
  };
  Light lamp;
  lamp.name = "lamp";
  lamp.shape = PointLight{{0, 0, 300}, glm::dvec3(1.0), 1.0};
  for (const glm::dmat3& covariance :
       {glm::dmat3(9.0), glm::dmat3{{4, 1, 3}, {1, 2, 0}, {3, 0, 100}}, glm::dmat3{{0, 0, 0}, {0, 0, 0}, {0, 0, 4}}}) {
    lamp.covariance_mm2 = covariance;
    EXPECT_EQ(rig(LightsJson({lamp})).covariance_mm2, covariance);
  }
  const auto stated = [](const char* covariance, const char* beside = "") {
    return JsonFile("rig", std::string(R"([{"name": "lamp", "type": "point", "position_mm": [0, 0, 300],
      "radiant_intensity_rgb": [1, 1, 1], "covariance": )") +
                               covariance + beside + "}]")
        .value;
  };
  EXPECT_THROW(rig(stated("[[1, 0, 0], [0, 1, 0], [0, 0.5, 1]]")), InputError);                      // not symmetric
  EXPECT_THROW(rig(stated("[[1, 0, 0], [0, 1, 2], [0, 2, 1]]")), InputError);                        // -1 mm2
  EXPECT_THROW(rig(stated("[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", ", \"stddev_mm\": 1")), InputError);  // both
}

TEST(CalibrateLights, TiltedCardsRefineARingFlash) {
  // Stated 6 mm too far forward and to the side.
  const DiskLight truth{{2, 0, 15}, {0, 0, 1}, glm::dvec3(4, 3.5, 3), 25, 35};
  Light start;
  start.name = "lamp";
  start.in_camera_frame = true;
  start.shape = DiskLight{{-2, 3, 19}, {0, 0, 1}, glm::dvec3(1.0), 25, 35};
  start.covariance_mm2 = glm::dmat3(36.0);
  std::vector<RigidTransform> poses;
  std::vector<Image> images;
  for (const auto& [distance, tilt, azimuth] : {std::tuple{130.0, 0.0, 0.0},
                                                {150.0, 40.0, 10.0},
                                                {150.0, 40.0, 130.0},
                                                {170.0, 40.0, 250.0},
                                                {260.0, 10.0, 0.0}}) {
    poses.push_back(LookingAt({0, 0, 0}, distance, tilt, azimuth, 0));
    images.push_back(CardPicture(truth, poses.back(), 3 + poses.size()));
  }
  std::vector<CardPhotograph> cards;
  for (size_t i = 0; i < poses.size(); ++i) cards.push_back(Card(images[i], poses[i]));
  std::vector<const CardPhotograph*> all;
  for (const auto& card : cards) all.push_back(&card);
  const auto rough = FitCards(start, all, false), fit = FitCards(start, all, true);
  ASSERT_TRUE(rough && fit);
  EXPECT_LT(fit->rms, 0.5 * rough->rms);
  const auto& found = std::get<DiskLight>(fit->light.shape);
  EXPECT_LT(glm::length(found.centre_mm - truth.centre_mm), std::max(1.0, 3 * fit->light.Stddev_mm()));
  EXPECT_LT(fit->light.Stddev_mm(), 3.0);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found.radiance[c] / truth.radiance[c], 1.0, 0.03);
}

TEST(CalibrateLights, PositionCovarianceCoversUnevenCards) {
  const PointLight truth{{-120, -90, 60}, glm::dvec3(30000), 2.0};
  for (const double fall_off : {0.0, 0.05, -0.05}) {
    const RigidTransform pose = LookingAt({0, 0, 0}, 250, 20, 30, 0);
    Image image = CardPicture(truth, pose, 3);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x)
        for (int c = 0; c < 3; ++c)
          image.at(x, y, c) *=
              static_cast<float>(1.0 - fall_off * (std::pow(x / 320.0 - 1.0, 2) + std::pow(y / 240.0 - 1.0, 2)));
    const CardPhotograph card = Card(image, pose);
    Light start;
    start.name = "lamp";
    start.shape = PointLight{truth.position_mm + glm::dvec3(4, -3, 2), glm::dvec3(1000.0), 2.0};
    start.covariance_mm2 = glm::dmat3(25.0);
    const auto fit = FitCards(start, {&card}, true);
    ASSERT_TRUE(fit);
    const glm::dvec3 off = std::get<PointLight>(fit->light.shape).position_mm - truth.position_mm;
    EXPECT_LT(glm::dot(off, glm::inverse(fit->light.covariance_mm2) * off), 14.2) << fall_off << ": 99.7 %";
  }
}

TEST(CalibrateLights, MisplacedLampIsRefused) {
  const RigidTransform pose = LookingAt({0, 0, 0}, 250, 20, 30, 0);
  const Image image = CardPicture(PointLight{{-60, -50, 190}, glm::dvec3(6000), 2.0}, pose, 3);
  Light start;
  start.name = "lamp";
  start.shape = PointLight{{120, 90, 60}, glm::dvec3(1000.0), 2.0};
  const Product product = LightsProduct({start}, {Card(image, pose)}, false, {});
  ASSERT_FALSE(product.refusals.empty());
  EXPECT_NE(product.refusals[0].find("shading disagrees"), std::string::npos) << product.refusals[0];
}

TEST(CalibrateLightsReal, ChromeBallMatchesTwelvePublishedLampDirections) {
  REQUIRE_REAL_DATA("chrome-ball-psbox");
  double circle[3], published[3][12];
  std::ifstream circle_file(real / "LightProbe-1/circle_data.txt"),
      directions(real / "LightProbe-1/light_directions.txt");
  for (double& v : circle) circle_file >> v;
  for (auto& row : published)
    for (double& v : row) directions >> v;
  ASSERT_TRUE(directions);
  std::vector<double> errors;
  for (int i = 0; i < 12; ++i) {
    char name[40];
    std::snprintf(name, sizeof name, "LightProbe-1/Image_%02d.JPG", i + 1);
    const ImageFile photo = ReadImageFile(real / name);
    // The published circles count rows from the bottom and pixels from 1.
    const BallOutline ball{{circle[0] - 0.5, photo.image.height - circle[1] + 0.5}, circle[2], 0};
    const auto error_of = [&](const BallOutline& outline) {
      const auto highlight = FindHighlight(photo.image, outline);
      if (!highlight) return 180.0;
      const auto ray = RayTowardsLamp(outline, *highlight, nullptr, 1.0);
      // The published frame has x right, y up, z towards the camera.
      const glm::dvec3 theirs(published[0][i], -published[1][i], -published[2][i]);
      return std::acos(std::min(1.0, glm::dot(ray->direction, glm::normalize(theirs)))) * 180 / 3.14159265358979;
    };
    errors.push_back(error_of(ball));
  }
  std::sort(errors.begin(), errors.end());
  std::printf("given outline: median %.2f, worst %.2f deg\n", errors[6], errors[11]);
  EXPECT_LT(errors[6], 0.5);
  // The outline detected in the photograph with room light.
  ImageFile mean = ReadImageFile(real / "LightProbe-1/ref.JPG");
  const auto found = FindBalls(mean, 1, 200);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_LT(glm::length(found[0].centre_px - glm::dvec2(circle[0] - 0.5, mean.image.height - circle[1] + 0.5)), 6.0);
  EXPECT_NEAR(found[0].radius_px, circle[2], 6.0);
}

}  // namespace
}  // namespace crownfit
