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
  int pixels = 64;  ///< of a picture's side
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
      "match",
      "Find parameters with which the viewer looks as the path model does with a material's own, under "
      "light made for it; written as the material's block \"viewer\".");
  match->add_option("MATERIAL", asked->material, "material.json or truth.json.")->required();
  match->add_option("--capture", asked->capture, "The crown: folder with capture.json, or that file.")->required();
  match->add_option("-o,--output", asked->output, "Where the material with its new block goes.")->required();
  match->add_option("--paths", asked->paths, "Paths a pixel of the pictures to match (default 256).")
      ->check(CLI::Range(8, 1000000));
  match->add_option("--pixels", asked->pixels, "Their width and height (default 64).")->check(CLI::Range(16, 1024));
  match->add_option("--seed", asked->seed, "Seed of the walks (default 1).");
  AddCommonOptions(match, asked->common);
  RunWith(match, command, asked, RunMatch);
}

}  // namespace crownfit
