// The command that measures lamps, by mirror balls and cards.

#include <algorithm>
#include <optional>
#include <variant>

#include "base/error.h"
#include "base/progress.h"
#include "calibrate/ball_lights.h"
#include "calibrate/draw.h"
#include "calibrate/estimate_lights.h"
#include "calibrate_steps.h"
#include "calibration/poses.h"

namespace crownfit {

int CalibrateLights(const CommandLine& line) {
  const CalibrateLine& asked = line.calibrate;
  if (asked.lights.empty() == asked.rig.empty())
    throw InputError("", "", "give either photographs of mirror balls (NAME=FILE) or a measured rig (--rig FILE)");
  std::optional<Camera> camera;
  if (!asked.camera.empty()) camera = ReadCamera(asked.camera);
  Progress progress(line.progress);
  std::vector<std::filesystem::path> inputs;
  std::vector<std::string> notes, refusals;
  std::vector<Light> lights;
  glm::dvec3 saturation(0.98);
  const auto read = [&](const std::filesystem::path& file) {
    progress.Show("reading", 0.3, file.filename().string());
    inputs.push_back(file);
    ImageFile photo = ReadLinear({file}, asked.is_linear)[0];
    saturation = RemoveBlack(photo.image, asked.noise);
    photo.is_srgb_encoded = false;
    return photo;
  };
  std::vector<ImageFile> balls;
  Image picture;
  balls.reserve(asked.lights.size());
  if (!asked.rig.empty()) {
    lights = ReadLightRig(asked.rig).lights;
    inputs.push_back(asked.rig);
    const auto has_card = [&](const std::string& light) {
      return std::any_of(asked.cards.begin(), asked.cards.end(),
                         [&](const std::string& card) { return card.starts_with(light + "="); });
    };
    for (const Light& light : lights)
      if (!light.in_camera_frame && !std::holds_alternative<DomeLight>(light.shape) && has_card(light.name))
        throw InputError(asked.rig, "lights",
                         "light '" + light.name +
                             "' stands in the object's frame; cards are placed "
                             "in the camera's",
                         "Measure the lamps from the camera, and state \"frame\": \"camera\".");
  } else {
    if (camera && asked.ball_mm <= 0) throw InputError("", "--ball-mm", "the balls' diameter is needed to place them");
    if (asked.balls.size() % 3) throw InputError("", "--ball", "expected X,Y,RADIUS for every ball");
    std::vector<BallPhotograph> photographs;
    for (const std::string& text : asked.lights) {
      const auto [name, file] = NamedFile(text, "BALLS");
      balls.push_back(read(file));
      if (camera) RequireSizeOf(*camera, balls.back().image, file, asked.camera);
      BallPhotograph photo{name, &balls.back().image, {}};
      for (size_t b = 0; b + 2 < asked.balls.size(); b += 3)
        photo.balls.push_back({{asked.balls[b], asked.balls[b + 1]}, asked.balls[b + 2], 0});
      if (photo.balls.empty()) photo.balls = FindBalls(balls.back(), asked.ball_count);
      if (photo.balls.empty())
        throw InputError(file, "", "no ball was found",
                         "Say where they are: --ball X,Y,RADIUS in pixels, once for each.");
      photographs.push_back(photo);
    }
    lights = LightsFromBalls(photographs, camera ? &*camera : nullptr, 0.5 * asked.ball_mm, notes);
    for (const BallPhotograph& photo : photographs)
      if (std::none_of(lights.begin(), lights.end(), [&](const Light& l) { return l.name == photo.light; }))
        refusals.push_back("light " + photo.light +
                           ": none of its balls shows it. Is the lamp on, are the balls where "
                           "--ball says?");
    picture = BallsPicture(photographs);
  }
  for (Light& light : lights)
    if (auto* point = std::get_if<PointLight>(&light.shape); point && asked.lamp_mm > 0)
      point->radius_mm = asked.lamp_mm;
  std::vector<ImageFile> cards;
  cards.reserve(asked.cards.size());
  std::vector<CardPhotograph> card_photographs;
  if (!asked.cards.empty()) {
    const auto poses = ReadPoses(Required(asked.card_poses, "--card-pose"));
    if (!camera) throw InputError("", "--camera", "is needed to read cards");
    if (asked.card_mm.size() != 4)
      throw InputError("", "--card-mm", "say which part of the card to read: X0,Y0,X1,Y1 in mm");
    for (const std::string& text : asked.cards) {
      const auto [name, file] = NamedFile(text, "--card");
      cards.push_back(read(file));
      RequireSizeOf(*camera, cards.back().image, file, asked.camera);
      card_photographs.push_back({name,
                                  &cards.back().image,
                                  *camera,
                                  PoseOf(poses, file, asked.card_poses).camera_from_object,
                                  {asked.card_mm[0], asked.card_mm[1]},
                                  {asked.card_mm[2], asked.card_mm[3]},
                                  glm::dvec3(asked.card_reflectance.value_or(0.9)),
                                  saturation});
    }
  }
  progress.Show("fitting", 0.7);
  Product product = LightsProduct(lights, card_photographs, asked.refine, notes);
  product.refusals.insert(product.refusals.begin(), refusals.begin(), refusals.end());
  AppendBelow(picture, product.picture);
  product.picture = picture;
  progress.Clear();
  return Finish(product, inputs, line);
}

}  // namespace crownfit
