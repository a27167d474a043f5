#include <CLI/CLI.hpp>

#include "command_line.h"
#include "command_line_parts.h"

namespace crownfit {

void AddView(CLI::App& app, CommandLine& line) {
  auto* view = app.add_subcommand("view",
                                  "The crown in the light, drawn by the graphics processor as the fit's model "
                                  "sees it: a window, or --screenshot or --benchmark without one.");
  view->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  view->add_option("--capture", line.capture, "Crown, cameras and lamps: folder with capture.json, or that file.");
  view->add_option("--mesh", line.meshes,
                   "In place of a capture: surface of a layer in mm (PLY, STL, OBJ); repeat it, "
                   "outermost first. Lit by two softboxes and a weak dome.")
      ->allow_extra_args(false);
  view->add_option("--photograph", line.photograph, "Whose camera and lamps (default: the first).");
  view->add_option("--screenshot", line.screenshot, "Write one picture: .exr (linear) or .png. Needs no display.");
  view->add_option("--size", line.size, "WxH: of the picture, in place of the camera's own; or of the window.");
  view->add_option("--benchmark", line.benchmark_frames, "Draw so many frames and print how long they take.")
      ->check(CLI::Range(1, 1000000));
  view->add_option("--save-to", line.save_to, "Folder for what the window saves (default: where you are).");
  view->add_flag("--physical", line.physical,
                 "Show the physical parameters where the material has effective ones (`crownfit match`).");
  view->add_flag("--print-layout", line.print_layout,
                 "For tests: print where the window's widgets stand, `name x y w h`, and `end`.");
  AddCommonOptions(view, line);
}

void AddMatch(CLI::App& app, CommandLine& line) {
  auto* match = app.add_subcommand(
      "match",
      "Find parameters with which the viewer looks as the path model does with a material's own, under "
      "light made for it; written as the material's block \"viewer\".");
  match->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  match->add_option("--capture", line.capture, "The crown: folder with capture.json, or that file.")->required();
  match->add_option("-o,--output", line.output, "Where the material with its new block goes.")->required();
  match->add_option("--paths", line.paths, "Paths a pixel of the pictures to match (default 256).")
      ->check(CLI::Range(8, 1000000));
  match->add_option("--pixels", line.pixels, "Their width and height (default 64).")->check(CLI::Range(16, 1024));
  match->add_option("--seed", line.fit.seed, "Seed of the walks (default 1).");
  AddCommonOptions(match, line);
}

}  // namespace crownfit
