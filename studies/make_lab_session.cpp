// make_lab_session OUT: photographs of a lab's calibration session, rendered for a camera, lamps and poses that only
// OUT/truth/ states: boards, a jig, mirror balls, cards, a colour chart, a step wedge twice, dark frames.

#include <cmath>
#include <cstdio>

#include "base/files.h"
#include "base/random.h"
#include "calibration/colour_chart.h"
#include "capture/blur.h"
#include "capture/light_rig.h"
#include "capture/poses.h"
#include "photo/image_io.h"
#include "scene/light_samples.h"
#include "support/rendered_target.h"

namespace crownfit {
namespace {

using Path = std::filesystem::path;
using Object = JsonValue::Object;

constexpr double kGain = 4e-5, kRead = 8e-4, kSigma_px = 0.9, kGlare = 0.012;

const Camera kCamera{.width = 640,
                     .height = 480,
                     .fx = 3412,
                     .fy = 3405,
                     .cx = 316.4,
                     .cy = 243.1,
                     .distortion = {-0.08, 0.1, 0.0006, -0.0004, 0, 0, 0, 0}};

struct Lamp {
  const char* name;
  PointLight light;  ///< in the camera frame
};
const Lamp kLamps[] = {{"left", {{-150, -60, 110}, glm::dvec3(26000, 24500, 22000), 4.0}},
                       {"right", {{140, -80, 95}, glm::dvec3(23000, 23500, 24000), 4.0}}};

RenderedLight Session(double level, uint64_t seed) {
  return {
      .level = level, .sigma_px = kSigma_px, .veiling_glare = kGlare, .gain = kGain, .read_noise = kRead, .seed = seed};
}

/// Grey as three channels, each with noise of its own.
Image Coloured(const Image& grey, uint64_t seed) {
  Image image(grey.width, grey.height, 3);
  for (size_t i = 0; i < image.values.size(); ++i) image.values[i] = grey.values[i / 3];
  return Noisy(image, kGain, kRead, seed);
}

/// Through the lens and onto the sensor.
Image Photographed(const Image& sharp, uint64_t seed) {
  const Blur blur{{{kSigma_px, 1.0}}, kGlare};
  return Noisy(Seen(sharp, blur, 0), kGain, kRead, seed);
}

Image Balls(const Lamp& lamp, uint64_t seed) {
  const glm::dvec3 centres[] = {{-13, 3, 248}, {14, -4, 255}};
  constexpr double kRadius = 5.0;
  Image image(kCamera.width, kCamera.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double sum = 0;
      for (int s = 0; s < 9; ++s) {
        const glm::dvec3 d = DirectionFromPixel(kCamera, {x + (s % 3 + 0.5) / 3, y + (s / 3 + 0.5) / 3});
        double value = 0.2;
        for (const glm::dvec3& centre : centres) {
          const double along = glm::dot(centre, d), q = along * along - glm::dot(centre, centre) + kRadius * kRadius;
          if (q <= 0) continue;
          const glm::dvec3 at = (along - std::sqrt(q)) * d, n = (at - centre) / kRadius, r = d - 2 * glm::dot(d, n) * n;
          const glm::dvec3 to = lamp.light.position_mm - at;
          const bool on_lamp = glm::dot(r, to) > 0 && glm::length(glm::cross(r, to)) < lamp.light.radius_mm;
          value = on_lamp ? 8.0 : 0.02 + 0.015 * std::max(0.0, -r.y);
        }
        sum += value / 9;
      }
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<float>(std::min(1.0, sum));
    }
  return Photographed(image, seed);
}

/// A ColorChecker that faces the camera, in even light; `sensor_from_rgb`: the camera's bands.
Image ColourCard(const glm::dmat3& sensor_from_rgb, uint64_t seed) {
  constexpr double kPatch_px = 60, kPitch_px = 1.1 * kPatch_px;  // gaps of a tenth
  const Chart chart = ReadChart("colorchecker_classic_2014");
  const glm::dvec2 corner(320 - 3 * kPitch_px, 240 - 2 * kPitch_px);
  Image image(kCamera.width, kCamera.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const glm::dvec2 at = (glm::dvec2(x + 0.5, y + 0.5) - corner) / kPitch_px, in = at - glm::floor(at);
      const bool on_card = at.x > -0.3 && at.y > -0.3 && at.x < 6.3 && at.y < 4.3;
      const bool on_patch = at.x >= 0 && at.y >= 0 && at.x < 6 && at.y < 4 && in.x < 1 / 1.1 && in.y < 1 / 1.1;
      glm::dvec3 rgb(on_card ? 0.025 : 0.4);
      if (on_patch) rgb = chart.patches[static_cast<size_t>(at.y) * 6 + static_cast<size_t>(at.x)].linear_rgb;
      const glm::dvec3 sensor = 0.8 * (sensor_from_rgb * rgb);
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = static_cast<float>(sensor[c]);
    }
  return Photographed(image, seed);
}

Image Card(const Lamp& lamp, const RigidTransform& camera_from_card, uint64_t seed) {
  const RigidTransform back = camera_from_card.Inverse();
  const glm::dvec3 normal = camera_from_card.Direction({0, 0, -1});
  Image image(kCamera.width, kCamera.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const glm::dvec3 d = DirectionFromPixel(kCamera, {x + 0.5, y + 0.5});
      const glm::dvec3 at = -back.translation_mm.z / back.Direction(d).z * d, to = lamp.light.position_mm - at;
      const double cosine = std::max(0.0, glm::dot(glm::normalize(to), normal));
      for (int c = 0; c < 3; ++c)
        image.at(x, y, c) = static_cast<float>(0.9 * lamp.light.radiant_intensity[c] * cosine / glm::dot(to, to));
    }
  return Photographed(image, seed);
}

void Write(const Path& out) {
  const Board board{.kind = BoardKind::kCharuco, .columns = 9, .rows = 6, .square_mm = 4};
  const PrintedTarget print = PrintedBoard(board);
  for (int i = 0; i < 14; ++i) {
    const auto u = [&](int k) { return Uniform(Key(5, i), k); };
    const glm::dvec3 aim(20 + 14 * (u(0) - 0.5), 14 + 10 * (u(1) - 0.5), 0);
    const RigidTransform pose = LookingAt(aim, 235 + 50 * u(2), i % 4 ? 15 + 25 * u(3) : 3, 360 * u(4), 360 * u(5));
    WriteImageFile(out / ("board/" + std::to_string(i) + ".exr"),
                   RenderTarget(print, glm::dvec2(4), kCamera, pose, Session(0.7, 10 + i)));
  }
  const PrintedTarget jig = PrintedJig({});
  const glm::dvec2 middle(0.5 * jig.size_mm.x);
  const RigidTransform tilts[] = {LookingAt({0, 2, 0}, 250, 4, 20, 1), LookingAt({0, 2, 0}, 245, 30, 200, -3)};
  for (int t = 0; t < 2; ++t) {
    const std::string name = "tilt" + std::to_string(t) + ".exr";
    WriteImageFile(out / "jig" / name,
                   Coloured(RenderTarget(jig, middle, kCamera, tilts[t], Session(0.6, 40 + t)), 50 + t));
    for (const Lamp& lamp : kLamps)
      WriteImageFile(out / ("card_" + std::string(lamp.name)) / name, Card(lamp, tilts[t], 60 + t));
  }
  const Image square = RenderTarget(jig, middle, kCamera, LookingAt({9, 25, 0}, 250, 2, 20, 1), Session(0.6, 44));
  WriteImageFile(out / "square.exr", Coloured(square, 54));
  for (const Lamp& lamp : kLamps) WriteImageFile(out / ("ball_" + std::string(lamp.name) + ".exr"), Balls(lamp, 70));
  const glm::dmat3 sensor_from_rgb({0.62, 0.21, 0.03}, {0.30, 0.70, 0.25}, {0.05, 0.12, 0.55});
  WriteImageFile(out / "chart.exr", ColourCard(sensor_from_rgb, 95));
  Image wedge(kCamera.width, kCamera.height, 3);
  for (int y = 0; y < wedge.height; ++y)
    for (int x = 0; x < wedge.width; ++x)
      for (int c = 0; c < 3; ++c) wedge.at(x, y, c) = static_cast<float>(0.85 * std::pow(0.86, x / 32 + 2 * (y / 60)));
  for (int k = 0; k < 2; ++k) {
    WriteImageFile(out / ("wedge" + std::to_string(k) + ".exr"), Photographed(wedge, 80 + k));
    WriteImageFile(out / ("dark" + std::to_string(k) + ".exr"),
                   Noisy(Image(kCamera.width, kCamera.height, 3), kGain, kRead, 90 + k));
  }

  // The truth, which calibration does not see.
  std::vector<Light> lights;
  for (const Lamp& lamp : kLamps) {
    Light light;
    light.name = lamp.name;
    light.in_camera_frame = true;
    light.shape = lamp.light;
    lights.push_back(light);
  }
  WriteTextFile(out / "truth/light_rig.json",
                ToJsonText(Object{{"format", "crownfit-light-rig/1"}, {"lights", LightsJson(lights)}}));
  WriteTextFile(out / "truth/camera.json",
                ToJsonText(Object{
                    {"format", "crownfit-camera/1"},
                    {"width", kCamera.width},
                    {"height", kCamera.height},
                    {"fx", kCamera.fx},
                    {"fy", kCamera.fy},
                    {"cx", kCamera.cx},
                    {"cy", kCamera.cy},
                    {"distortion", std::vector<double>(kCamera.distortion.begin(), kCamera.distortion.begin() + 5)}}));
  WriteTextFile(out / "truth/blur.json",
                ToJsonText(Object{{"format", "crownfit-blur/1"},
                                  {"psf", JsonValue::Array{Object{{"sigma_px", kSigma_px}, {"weight", 1.0}}}},
                                  {"veiling_glare", kGlare}}));
  JsonValue::Array rows;
  const glm::dmat3 rgb_from_sensor = glm::inverse(0.8 * sensor_from_rgb);
  for (int r = 0; r < 3; ++r)
    rows.emplace_back(std::vector<double>{rgb_from_sensor[0][r], rgb_from_sensor[1][r], rgb_from_sensor[2][r]});
  WriteTextFile(out / "truth/colour.json",
                ToJsonText(Object{{"format", "crownfit-colour/1"}, {"linear_rgb_from_sensor_rgb", rows}}));
  const std::vector<double> gain(3, kGain), read(3, kRead);
  WriteTextFile(out / "truth/noise.json",
                ToJsonText(Object{{"format", "crownfit-noise/1"}, {"gain", gain}, {"read_noise", read}}));
  // The crown's frame has z towards the camera and y up: half a turn about x.
  const RigidTransform facing{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0.4, -0.3, 250}};
  const auto turned = [&](double deg) {
    const double a = deg * 3.14159265358979 / 180;
    const glm::dmat3 r({std::cos(a), 0, -std::sin(a)}, {0, 1, 0}, {std::sin(a), 0, std::cos(a)});
    return RigidTransform{facing.rotation * r, facing.translation_mm};
  };
  const std::vector<StatedPose> truth{
      {"front_left", turned(0)}, {"front_right", turned(0)}, {"turned_left", turned(-38)}, {"turned", turned(38)}};
  WriteTextFile(out / "truth/poses.json",
                ToJsonText(Object{{"format", "crownfit-poses/1"}, {"poses", PosesJson(truth)}}));
  // The jig, in its holder with the crown: 6 mm behind it, and photographed wherever the crown is.
  const RigidTransform object_from_jig{{{1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, -6}};
  for (size_t i = 0; i < truth.size(); ++i)
    WriteImageFile(out / "holder" / (truth[i].photograph + ".exr"),
                   Coloured(RenderTarget(jig, middle, kCamera, truth[i].camera_from_object * object_from_jig,
                                         Session(0.6, 46 + i)),
                            56 + i));
}

}  // namespace
}  // namespace crownfit

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: make_lab_session OUT\n");
    return 2;
  }
  crownfit::Write(argv[1]);
  return 0;
}
