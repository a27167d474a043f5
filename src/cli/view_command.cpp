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
  std::vector<std::filesystem::path> meshes;  ///< in place of a capture, outermost first
  std::string photograph;                     ///< empty: the first
  std::optional<std::filesystem::path> screenshot;
  std::string size;          ///< WxH; empty: the camera's
  int benchmark_frames = 0;  ///< 0: none
  std::filesystem::path save_to = ".";
  bool physical = false;  ///< not the block "viewer"
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
  auto* view = app.add_subcommand("view",
                                  "The crown in the light, drawn by the graphics processor as the fit's model "
                                  "sees it: a window, or --screenshot or --benchmark without one.");
  view->add_option("MATERIAL", asked->material, "material.json or truth.json.")->required();
  view->add_option("--capture", asked->capture, "Crown, cameras and lamps: folder with capture.json, or that file.");
  view->add_option("--mesh", asked->meshes,
                   "In place of a capture: surface of a layer in mm (PLY, STL, OBJ); repeat it, "
                   "outermost first. Lit by two softboxes and a weak dome.")
      ->allow_extra_args(false);
  view->add_option("--photograph", asked->photograph, "Whose camera and lamps (default: the first).");
  view->add_option("--screenshot", asked->screenshot, "Write one picture: .exr (linear) or .png. Needs no display.");
  view->add_option("--size", asked->size, "WxH: of the picture, in place of the camera's own; or of the window.");
  view->add_option("--benchmark", asked->benchmark_frames, "Draw so many frames and print how long they take.")
      ->check(CLI::Range(1, 1000000));
  view->add_option("--save-to", asked->save_to, "Folder for what the window saves (default: where you are).");
  view->add_flag("--physical", asked->physical,
                 "Show the physical parameters where the material has effective ones (`crownfit match`).");
  view->add_flag("--print-layout", asked->print_layout,
                 "For tests: print where the window's widgets stand, `name x y w h`, and `end`.");
  AddCommonOptions(view, asked->common);
  RunWith(view, command, asked, RunView);
}

}  // namespace crownfit
