#include <cstdio>

#include "base/files.h"
#include "cli/common_options.h"
#include "match_view.h"
#include "optics/material_file.h"

namespace crownfit {
namespace {

struct MatchCommand {
  std::filesystem::path material, capture, output;
  int paths = 256;  ///< per pixel
  int pixels = 64;  ///< width and height of a picture
  uint64_t seed = 1;
  CommonOptions common;
};

int RunMatch(const MatchCommand& asked) {
  Progress progress(asked.common.progress);
  const Capture capture = ReadCapture(asked.capture);
  const Material material = ReadMaterialFile(asked.material, capture);
  const MatchOptions options{asked.paths, asked.pixels, asked.seed, asked.common.threads};
  const ViewMatch match = MatchView(capture, material, options, progress);
  progress.Clear();
  WriteTextFile(asked.output, MaterialJsonWithMatch(asked.material, match, options));
  std::printf("%s\n%s\n", MatchSummary(match, material).c_str(), asked.output.c_str());
  return 0;
}

}  // namespace

void AddMatch(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<MatchCommand>();
  auto* match = app.add_subcommand(
      "match", "Finds effective parameters with which the viewer looks like path tracing with the physical ones.");
  match->footer(
      "The pictures to match are path-traced in a studio of their own, under several lamps. The effective parameters "
      "are\n"
      "written to the block \"viewer\" of the material; `crownfit view` then shows them.\n\n"
      "Example:\n"
      "  crownfit match result/material.json --capture crown -o matched.json\n"
      "  crownfit view matched.json --capture crown");
  match->add_option("MATERIAL", asked->material, "material.json of a fit, or truth.json.")->required();
  match->add_option("--capture", asked->capture, "Capture of the crown: folder that holds capture.json, or that file.")
      ->required();
  match->add_option("-o,--output", asked->output, "File for the material with its block \"viewer\".")->required();
  match->add_option("--paths", asked->paths, "Paths per pixel of the pictures to match (default 256).")
      ->check(CLI::Range(8, 1000000));
  match->add_option("--pixels", asked->pixels, "Width and height of these pictures (default 64).")
      ->check(CLI::Range(16, 1024));
  match->add_option("--seed", asked->seed, "Seed of the paths (default 1).");
  AddCommonOptions(match, asked->common);
  RunWith(match, command, asked, RunMatch);
}

}  // namespace crownfit
