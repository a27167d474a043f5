#include <cstdio>

#include "base/files.h"
#include "cli/common_options.h"
#include "synthetic/synthesize.h"

namespace crownfit {
namespace {

struct SynthesizeCommand {
  std::filesystem::path recipe, output;
  CommonOptions common;
};

int RunSynthesize(const SynthesizeCommand& asked) {
  Progress progress(asked.common.progress);
  const Recipe recipe = ReadRecipe(asked.recipe);
  MakeFolder(asked.output);
  const auto messages = Synthesize(recipe, asked.output, asked.common.threads,
                                   [&](const std::string& stage, double share) { progress.Show(stage, share); });
  progress.Clear();
  PrintNotes(messages);
  std::printf("%s\n", (asked.output / "capture.json").c_str());
  return 0;
}

}  // namespace

void AddSynthesize(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<SynthesizeCommand>();
  auto* synthesize = app.add_subcommand(
      "synthesize", "Path-traces a capture of a known material: photographs, calibration, meshes, truth.json.");
  synthesize->footer(
      "Example:\n"
      "  crownfit synthesize recipe.json -o synthetic\n"
      "  crownfit fit synthetic -o result\n"
      "Compare result/material.json with the true values in synthetic/truth.json.");
  synthesize->add_option("RECIPE", asked->recipe, "recipe.json: a capture with known values (docs/file_formats.md).")
      ->required();
  synthesize->add_option("-o,--output", asked->output, "Folder for the capture; it is created if missing.")->required();
  AddCommonOptions(synthesize, asked->common);
  RunWith(synthesize, command, asked, RunSynthesize);
}

}  // namespace crownfit
