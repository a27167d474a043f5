#include <algorithm>
#include <optional>
#include <variant>

#include "base/error.h"
#include "base/progress.h"
#include "calibration/ball_lights.h"
#include "calibration/draw.h"
#include "calibration/estimate_lights.h"
#include "capture/poses.h"
#include "cli/calibrate_parts.h"
#include "cli/named_file.h"
#include "exchange/opencv_file.h"

namespace crownfit {
namespace {

struct LightsTask {
  ProductOptions product;
  std::vector<std::string> lights, cards;  ///< NAME=FILE
  std::filesystem::path camera, rig, card_poses;
  double ball_mm = 0;
  int ball_count = 1;
  std::vector<double> balls;               ///< x, y, radius of each ball, in pixels
  double lamp_mm = 0;                      ///< radius of the lamps; 0: 1 degree, seen from the balls
  std::vector<double> card_mm;             ///< low x, low y, high x, high y of the area to read
  std::optional<double> card_reflectance;  ///< default 0.9
  bool refine = false;
  std::optional<std::filesystem::path> noise;
  std::string encoding = "file";
};

int RunLights(const LightsTask& asked) {
  if (asked.lights.empty() == asked.rig.empty())
    throw InputError("", "", "give either photographs of mirror balls (NAME=FILE) or a measured rig (--rig FILE)");
  std::optional<Camera> camera;
  if (!asked.camera.empty()) camera = ReadCameraOrOpenCv(asked.camera);
  Progress progress(asked.product.common.progress);
  std::vector<std::filesystem::path> inputs;
  std::vector<std::string> notes, refusals;
  std::vector<Light> lights;
  glm::dvec3 saturation(0.98);
  const auto read = [&](const std::filesystem::path& file) {
    progress.Show("reading", 0.3, file.filename().string());
    inputs.push_back(file);
    ImageFile photo = ReadLinear({file}, asked.encoding)[0];
    saturation = RemoveBlack(photo, file, asked.noise);
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
        throw InputError(
            asked.rig, "lights",
            "light '" + light.name + "' is stated in the object's frame, but cards are placed in the camera's",
            "Measure the lamps from the camera, and write \"frame\": \"camera\".");
  } else {
    if (camera && asked.ball_mm <= 0)
      throw InputError("", "--ball-mm", "the diameter of the balls is needed to locate them");
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
                         "Give their places: --ball X,Y,RADIUS in pixels, once for each ball.");
      photographs.push_back(photo);
    }
    lights = LightsFromBalls(photographs, camera ? &*camera : nullptr, 0.5 * asked.ball_mm, notes);
    for (const BallPhotograph& photo : photographs)
      if (std::none_of(lights.begin(), lights.end(), [&](const Light& l) { return l.name == photo.light; }))
        refusals.push_back("light " + photo.light +
                           ": no ball shows its highlight. Check that the lamp was on, and that --ball gives the "
                           "places of the balls.");
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
    if (!camera) throw InputError("", "--camera", "this option is needed to read cards");
    if (asked.card_mm.size() != 4)
      throw InputError("", "--card-mm", "give the part of the card to read: X0,Y0,X1,Y1 in mm");
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
  return Finish(product, inputs, asked.product);
}

}  // namespace

void AddCalibrateLights(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<LightsTask>();
  auto* lights =
      AddProduct(&calibrate, asked->product, "lights",
                 "Finds directions and places of lamps from mirror balls, and their intensities from a card.");
  lights->footer(
      "Example:\n"
      "  crownfit calibrate lights left=balls_left.dng right=balls_right.dng --camera camera.json --ball-mm 20 --balls "
      "2 \\\n"
      "    --card left=card_left.dng --card right=card_right.dng --card-pose card_poses.json --card-mm 20,-15,50,15 "
      "\\\n"
      "    -o light_rig.json\n"
      "Without cards the intensities stay unknown, and every fit frees them.");
  lights->add_option("BALLS", asked->lights,
                     "NAME=FILE: a photograph of polished balls with only lamp NAME on. Several of one lamp are\n"
                     "combined.");
  lights->add_option(
      "--camera", asked->camera,
      "camera.json, or a calibration by OpenCV (.yml, .xml). Without it only directions are found, by parallel\n"
      "projection.");
  lights->add_option("--ball-mm", asked->ball_mm, "Diameter of the balls in mm.")->check(CLI::PositiveNumber);
  lights->add_option("--balls", asked->ball_count, "Number of balls in a photograph (default 1).")
      ->check(CLI::Range(1, 20));
  lights->add_option("--ball", asked->balls, "X,Y,RADIUS in pixels of a ball, if balls are not found. Repeatable.")
      ->delimiter(',');
  lights
      ->add_option("--lamp-mm", asked->lamp_mm,
                   "Radius of the lamps in mm (default: 1 degree as seen from the balls). It shows in highlights\n"
                   "on a smooth surface.")
      ->check(CLI::PositiveNumber);
  lights->add_option("--rig", asked->rig,
                     "Instead of balls: a measured light_rig.json in the camera frame (ring and twin flashes).");
  lights
      ->add_option("--card", asked->cards,
                   "NAME=FILE: a photograph of a white or grey card with only lamp NAME on. Repeatable.")
      ->take_all();
  lights->add_option("--card-pose", asked->card_poses,
                     "poses.json of these photographs, from a jig or board on the card.");
  lights->add_option("--card-mm", asked->card_mm, "X0,Y0,X1,Y1 in mm in the jig's frame: the part of the card to read.")
      ->expected(4)
      ->delimiter(',');
  lights
      ->add_option("--card-reflectance", asked->card_reflectance,
                   "Reflectance of the card (default 0.9; grey cards have 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  lights->add_flag("--refine", asked->refine, "Move each lamp to the place that fits the shading of the cards.");
  lights->add_option("--noise", asked->noise, "noise.json of the camera, for black level and saturation.");
  AddEncodingOptions(lights, asked->encoding);
  RunWith(lights, command, asked, RunLights);
}

}  // namespace crownfit
