#include <CLI/CLI.hpp>

#include "command_line.h"
#include "command_line_parts.h"

namespace crownfit {
namespace {

CLI::App* AddTask(CLI::App* calibrate, CommandLine& line, const char* name, const std::string& what) {
  auto* task = calibrate->add_subcommand(name, what);
  task->add_option("-o,--output", line.output, "The file to write.");
  task->add_option("--picture", line.calibrate.picture, "PNG to look at (default: beside the file, .png).");
  task->add_flag("--json", line.json, "Print JSON.");
  AddCommonOptions(task, line);
  return task;
}

void AddImages(CLI::App* task, CommandLine& line, const char* what) {
  task->add_option("IMAGES", line.calibrate.images, what)->required();
}

void AddBoard(CLI::App* task, CommandLine& line) {
  Board& board = line.calibrate.board;
  task->add_option("--corners", line.calibrate.corners,
                   "COLUMNSxROWS of inner corners, such as 9x6: one less than squares. apriltag: tags.");
  task->add_option("--square-mm", board.square_mm, "A square's size, measured on the print. apriltag: a tag's.");
  task->add_option("--marker-mm", board.marker_mm, "charuco: a marker's size (default: 3/4 of a square).");
  task->add_option("--gap-mm", board.gap_mm, "apriltag: between tags (default: 3/10 of a tag).");
  task->add_option("--dictionary", board.dictionary,
                   "The markers', OpenCV's name (default 4X4_250; APRILTAG_36h11; jig: 4X4_50).");
}

}  // namespace

void AddCalibrate(CLI::App& app, CommandLine& line) {
  auto* calibrate = app.add_subcommand(
      "calibrate",
      "Makes what a capture needs from photographs: each command writes one file, prints how good it is, draws a\n"
      "picture of it, and writes nothing when it is not good enough (exit code 1). docs/calibration.md walks through.");
  calibrate->require_subcommand(1);

  auto* camera = AddTask(calibrate, line, "camera",
                         "Focal length, principal point and distortion from 10 to 20 photographs of a board.");
  AddImages(camera, line, "Photographs of the board, tilted in different directions, with one focus and aperture.");
  camera->add_option("--board", line.calibrate.target, "chessboard, charuco or apriltag (a grid of tags).")->required();
  AddBoard(camera, line);
  camera->add_option("--distortion", line.calibrate.distortion,
                     "none, radial1, radial2, radial2_tangential or full (default: as much as the corners tell).");

  auto* noise = AddTask(calibrate, line, "noise",
                        "Gain, read noise, black level and saturation from pairs of photographs of a still scene.");
  AddImages(noise, line,
            "Pairs A A' B B' ..., each twice the same, with light and dark places, nothing moved. RAW or linear.");
  noise->add_option("--dark", line.calibrate.darks, "Frames with the lens cap on (at least two for the read noise).");
  noise->add_flag("--series", line.calibrate.is_series,
                  "IMAGES are one still scene at rising exposures: neighbours make pairs, and linearity is checked.");
  noise->add_flag("--linear", line.calibrate.is_linear, "Take the files as linear, such as a machine-vision camera's.");

  auto* exposures = AddTask(calibrate, line, "exposures",
                            "One linear picture (EXR, and its variance beside it) from exposures of a still scene.");
  AddImages(exposures, line, "The exposures, in any order. Encoded ones (JPEG, PNG): their response is found first.");
  exposures->add_option("--times", line.calibrate.times, "Their exposure times, in the same order, any unit.")
      ->required()
      ->delimiter(',');
  exposures->add_option("--noise", line.calibrate.noise, "noise.json of the camera: black level, weights, variance.");
  exposures->add_option("--dark", line.calibrate.darks, "Frames with the lens cap on: their mean is the black level.");
  exposures->add_flag("--linear", line.calibrate.is_linear, "Take the files as linear.");

  auto* blur =
      AddTask(calibrate, line, "blur",
              "Point spread and veiling glare from a photograph of a slanted dark square (`calibrate target jig`).");
  AddImages(blur, line, "One photograph, focused as for the crown, paper at half of saturation. RAW or linear.");
  blur->add_option("--region", line.calibrate.region,
                   "X,Y,WIDTH,HEIGHT in pixels, where the square is (default: anywhere).")
      ->expected(4)
      ->delimiter(',');
  blur->add_option("--dark-reflectance", line.calibrate.dark_reflectance,
                   "Of the square, for the veiling glare: 0.03 to 0.05 for ink, 0 for a hole into a dark box.")
      ->check(CLI::Range(0.0, 0.5));
  blur->add_option("--light-reflectance", line.calibrate.light_reflectance, "Of the paper (default 0.9).")
      ->check(CLI::Range(0.1, 1.0));
  blur->add_option("--noise", line.calibrate.noise, "noise.json of the camera: black level and saturation.");
  blur->add_flag("--linear", line.calibrate.is_linear, "Take the file as linear.");

  auto* colour =
      AddTask(calibrate, line, "colour",
              "From the camera's own values to linear sRGB, by a photograph of a ColorChecker Classic or Passport.");
  AddImages(colour, line, "One photograph of the chart in the crown's place and light, its white patch unsaturated.");
  colour->add_option(
      "--chart", line.calibrate.chart,
      "colorchecker_classic_2014 (default), colorchecker_classic_before_2014, or a file like those in calib/.");
  colour
      ->add_option(
          "--chart-corners", line.calibrate.chart_corners,
          "X1,Y1,...,X4,Y4 in pixels: outer corners of the outer patches, clockwise from the first patch's (dark\n"
          "skin); for charts that are not found.")
      ->expected(8)
      ->delimiter(',');
  colour
      ->add_option("--grey-card", line.calibrate.grey_card,
                   "X,Y,WIDTH,HEIGHT in pixels, on a grey card: the white balance alone, without a chart.")
      ->expected(4)
      ->delimiter(',');
  colour->add_option("--card-reflectance", line.calibrate.card_reflectance, "Of the grey card (default 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  colour->add_option("--flat-field", line.calibrate.flat_field,
                     "A white card in the chart's place: evens out the light.");
  colour->add_option("--noise", line.calibrate.noise, "noise.json of the camera: black level and saturation.");
  colour->add_flag("--linear", line.calibrate.is_linear, "Take the file as linear.");

  auto* pose = AddTask(
      calibrate, line, "pose",
      "Where the object is in photographs: by markers of a jig or board around it, or by the scan's own outline.");
  AddImages(pose, line, "Photographs of one camera; the poses are named after the files.");
  pose->add_option("--camera", line.calibrate.camera, "camera.json of the camera.")->required();
  pose->add_option("--jig", line.calibrate.jig, "The jig's markers, as `crownfit calibrate target jig` writes them.");
  pose->add_option("--board", line.calibrate.target, "In its place: chessboard, charuco or apriltag.");
  AddBoard(pose, line);
  pose->add_option("--mesh", line.calibrate.meshes,
                   "In place of markers: the scan in mm (PLY, STL, OBJ); repeat it for more crowns.")
      ->allow_extra_args(false)
      ->group("Scan");
  pose->add_option("--start", line.calibrate.start, "poses.json with a rough pose of every photograph.")->group("Scan");
  pose->add_option(
          "--placed", line.calibrate.placed,
          "X,Y,Z,RX,RY,RZ: where the scan's frame lies in the start's, roughly: its origin in mm and a rotation "
          "vector in degrees. For starts that are a jig's poses.")
      ->expected(6)
      ->delimiter(',')
      ->group("Scan");
  pose->add_option("--search-mm", line.calibrate.search_mm, "How far off the rough poses may be (default 5).")
      ->check(CLI::Range(0.0, 100.0))
      ->group("Scan");
  pose->add_option("--search-deg", line.calibrate.search_deg, "The same in degrees (default 5).")
      ->check(CLI::Range(0.0, 45.0))
      ->group("Scan");
  pose->add_flag(
          "--together", line.calibrate.together,
          "The rough poses are right relative to each other (from a jig): find one motion of the object for all.")
      ->group("Scan");

  auto* lights =
      AddTask(calibrate, line, "lights",
              "Directions and places of lamps from mirror balls, intensities and colours from a white or grey card.");
  lights->add_option("BALLS", line.calibrate.lights,
                     "NAME=FILE: a photograph of polished balls under one lamp alone; several of one lamp are joined.");
  lights->add_option("--camera", line.calibrate.camera,
                     "camera.json; without it directions only, in parallel projection.");
  lights->add_option("--ball-mm", line.calibrate.ball_mm, "The balls' diameter.")->check(CLI::PositiveNumber);
  lights->add_option("--balls", line.calibrate.ball_count, "How many there are in a photograph (default 1).")
      ->check(CLI::Range(1, 20));
  lights
      ->add_option("--ball", line.calibrate.balls,
                   "X,Y,RADIUS in pixels of a ball, where they are not found; repeat it.")
      ->delimiter(',');
  lights
      ->add_option("--lamp-mm", line.calibrate.lamp_mm,
                   "The lamps' radius (default: seen under a degree). Highlights on a smooth surface show it.")
      ->check(CLI::PositiveNumber);
  lights->add_option("--rig", line.calibrate.rig,
                     "In place of balls: light_rig.json as measured, in the camera frame (ring and twin flashes).");
  lights
      ->add_option("--card", line.calibrate.cards,
                   "NAME=FILE: a photograph of the card under one lamp alone; repeat it.")
      ->take_all();
  lights->add_option("--card-pose", line.calibrate.card_poses,
                     "poses.json of those photographs, from a jig or board on the card.");
  lights
      ->add_option("--card-mm", line.calibrate.card_mm, "X0,Y0,X1,Y1 in the jig's frame: the part of the card to read.")
      ->expected(4)
      ->delimiter(',');
  lights
      ->add_option("--card-reflectance", line.calibrate.card_reflectance,
                   "Of the card (default 0.9; grey cards: 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  lights->add_flag("--refine", line.calibrate.refine, "Move each lamp to where the cards' shading says it is.");
  lights->add_option("--noise", line.calibrate.noise, "noise.json of the camera: black level and saturation.");
  lights->add_flag("--linear", line.calibrate.is_linear, "Take the files as linear.");

  auto* target =
      calibrate->add_subcommand("target", "Writes a target to print, as SVG in mm, and a jig's markers as JSON.");
  target->add_option("KIND", line.calibrate.target, "chessboard, charuco, apriltag, or jig: markers around a crown.")
      ->required();
  target->add_option("-o,--output", line.output, "The SVG to write; a jig's markers go beside it, .json.")->required();
  AddBoard(target, line);
  target->add_option("--inside-mm", line.calibrate.inside_mm, "jig: width of the place for the crown (default 16).")
      ->check(CLI::PositiveNumber);
}

void AddCapture(CLI::App& app, CommandLine& line) {
  auto* capture = app.add_subcommand(
      "capture",
      "Makes captures, of photographs or of an instrument's readings: see crownfit capture init --help and\n"
      "crownfit capture measured --help.");
  capture->require_subcommand(1);
  AddCaptureMeasured(*capture, line);
  auto* init = capture->add_subcommand(
      "init",
      "Gathers meshes, photographs and calibration products into a folder with capture.json, and checks it. "
      "Scattering,\n"
      "absorption and roughness are left free, exposures fixed to 1; edit capture.json for the rest.");
  CalibrateLine& c = line.calibrate;
  init->add_option("-o,--output", line.output, "The capture's folder (made when missing).")->required();
  init->add_option("--mesh", c.init_meshes,
                   "LAYER=FILE: surface of a layer in mm, such as enamel=crown.stl; outermost first.")
      ->take_all()
      ->required();
  init->add_option("--layer", c.parts.more_layers, "A further layer inside, without a mesh, such as dentine.")
      ->take_all();
  init->add_option("--thickness-mm", c.parts.thickness_mm, "Of the layer above such a one (default 0.8).")
      ->check(CLI::PositiveNumber);
  init->add_option("--photo", c.init_photographs, "NAME=FILE: a photograph; repeat it.")->take_all()->required();
  init->add_option("--camera", c.parts.camera, "camera.json of `crownfit calibrate camera`.")->required();
  init->add_option("--poses", c.parts.poses,
                   "poses.json of `crownfit calibrate pose`; poses are found by the files' names.")
      ->required();
  init->add_option("--lights", c.parts.lights, "light_rig.json of `crownfit calibrate lights`.")->required();
  init->add_option("--lit", c.init_lit, "NAME=LIGHT,LIGHT: the lights that were on (default: all).")->take_all();
  init->add_option("--polarisation", c.init_polarisation, "NAME=none, cross or parallel.")->take_all();
  init->add_option("--mask", c.init_masks, "NAME=FILE: use only where this picture is above 0.5.")->take_all();
  init->add_option("--noise", c.parts.noise, "noise.json of `crownfit calibrate noise`.");
  init->add_option("--colour", c.parts.colour, "colour.json of `crownfit calibrate colour`.");
  init->add_option("--blur", c.parts.blur, "blur.json of `crownfit calibrate blur`.");
  init->add_option("--holdout", c.parts.holdouts, "NAME of a photograph that the fit is not to see.")->take_all();
  AddCommonOptions(init, line);
  init->add_flag("--exposure-free", c.parts.exposure_is_free,
                 "Exposures are unknown: no card gave the lights' intensity.");
}

}  // namespace crownfit
