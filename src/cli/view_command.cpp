#include <cstdio>
#include <optional>
#include <utility>

#include "base/error.h"
#include "cli/common_options.h"
#include "cli/named_photograph.h"
#include "optics/material_file.h"
#include "shader/predict.h"
#include "viewer/mesh_capture.h"
#include "viewer/view_crown.h"
#include "viewer/view_window.h"

namespace crownfit {
namespace {

struct ViewCommand {
  std::filesystem::path material, capture;
  std::vector<std::filesystem::path> meshes;  ///< instead of a capture, outermost first
  std::string photograph;                     ///< empty: the first
  std::optional<std::filesystem::path> screenshot;
  std::string size;          ///< WxH; empty: the camera's
  int benchmark_frames = 0;  ///< 0: none
  std::filesystem::path save_to = ".";
  bool physical = false;  ///< ignores the block "viewer"
  bool print_layout = false;
  CommonOptions common;
};

std::optional<std::pair<int, int>> SizeOf(const std::string& text) {
  if (text.empty()) return std::nullopt;
  int width = 0, height = 0;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &rest) != 2 || width < 1 || height < 1 || width > 16384 ||
      height > 16384)
    throw InputError("", "--size", "'" + text + "' is not a size", "Write WxH, such as 1920x1080.");
  return std::pair{width, height};
}

int RunView(const ViewCommand& asked) {
  if (asked.capture.empty() == asked.meshes.empty())
    throw InputError("", "view", asked.capture.empty() ? "no crown is given" : "--capture and --mesh are both given",
                     "Give either --capture CAPTURE or --mesh FILE (repeated, outermost layer first).");
  Progress progress(asked.common.progress);
  const Capture capture =
      asked.meshes.empty() ? ReadCapture(asked.capture) : CaptureOfMeshes(asked.meshes, asked.material);
  MaterialRecord record = ReadMaterialRecord(asked.material, capture);
  const std::string note = asked.physical ? "" : EffectiveNote(record);
  if (record.effective && !asked.physical) record.material = *record.effective;
  const size_t photograph = NamedPhotograph(capture, asked.photograph).value_or(0);
  const auto size = SizeOf(asked.size);
  if (!asked.screenshot && asked.benchmark_frames == 0) {
    ViewInWindow(capture, record,
                 {asked.material, photograph, size, asked.save_to, asked.print_layout, asked.meshes.empty(),
                  asked.common.threads, note},
                 progress);
    return 0;
  }
  const ViewOptions options{photograph, size, asked.screenshot, asked.benchmark_frames, asked.common.threads};
  const std::string said = ViewCrown(capture, record.material, options, progress);
  std::fputs(said.c_str(), stdout);
  if (!note.empty()) std::printf("Shows %s.\n", note.c_str());
  if (const std::string left_out = WhatShaderLeavesOut(capture); !left_out.empty()) PrintNotes({left_out});
  if (asked.screenshot) std::printf("%s\n", asked.screenshot->c_str());
  return 0;
}

}  // namespace

void AddView(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<ViewCommand>();
  auto* view = app.add_subcommand(
      "view", "Shows the crown in a window, drawn on the graphics processor with the formulas of model shader.");
  view->footer(
      "Example:\n"
      "  crownfit view result/material.json --capture crown\n"
      "  crownfit view result/material.json --mesh crown.stl --size 800x800 --screenshot crown.png\n"
      "In the window, F1 lists mouse and keys.");
  view->add_option("MATERIAL", asked->material, "material.json of a fit, or truth.json.")->required();
  view->add_option("--capture", asked->capture,
                   "Take crown, cameras, lamps and photographs from this capture: folder that holds\n"
                   "capture.json, or that file.");
  view->add_option("--mesh", asked->meshes,
                   "Instead of a capture: surface of a layer in mm (PLY, STL, OBJ). Repeatable, outermost layer\n"
                   "first. Two softboxes and a weak dome light it.")
      ->allow_extra_args(false);
  view->add_option("--photograph", asked->photograph,
                   "Photograph whose camera and lamps are used first (default: the first photograph).");
  view->add_option("--screenshot", asked->screenshot,
                   "Write one picture, .exr (linear) or .png, and open no window. Needs no display.");
  view->add_option("--size", asked->size,
                   "WxH: size of the picture (default: the camera's) or of the window (default: 1400x900).");
  view->add_option("--benchmark", asked->benchmark_frames,
                   "Draw this many frames without a window, and print how long they take.")
      ->check(CLI::Range(1, 1000000));
  view->add_option("--save-to", asked->save_to,
                   "Folder for files that the window saves (default: the current folder).");
  view->add_flag("--physical", asked->physical,
                 "Show the physical parameters even if the material has effective ones (`crownfit match`).");
  view->add_flag("--print-layout", asked->print_layout,
                 "For tests: print the place of the window's widgets, `name x y w h`, then `end`.");
  AddCommonOptions(view, asked->common);
  RunWith(view, command, asked, RunView);
}

}  // namespace crownfit
