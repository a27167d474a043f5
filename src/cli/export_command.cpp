#include <cstdio>

#include "cli/common_options.h"
#include "exchange/export_material.h"
#include "exchange/exporters.h"

namespace crownfit {
namespace {

struct ExportCommand {
  std::filesystem::path material, output;
  ExportOptions options;
  CommonOptions common;
};

int RunExport(const ExportCommand& asked) {
  ExportOptions options = asked.options;
  options.threads = asked.common.threads;
  Progress progress(asked.common.progress);
  const auto said = ExportMaterial(asked.material, options, asked.output, progress);
  progress.Clear();
  PrintNotes(said);
  std::printf("%s\n", (asked.output / "README.md").c_str());
  return 0;
}

}  // namespace

void AddExport(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<ExportCommand>();
  auto* exported = app.add_subcommand(
      "export",
      "Writes a material as files of another program, with a README that says what is converted and what is lost.");
  exported->footer(
      "Formats:\n"
      "  mitsuba, pbrt   a medium and a boundary for every layer; with --capture a scene for every photograph\n"
      "  blender         a Python script: one medium, or a volume per layer; with --capture the scene\n"
      "  gltf            crown.glb for viewers; with --capture the crown's surface\n"
      "  materialx       OpenPBR subsurface, of all layers as one and of every layer\n"
      "  csv             every value with its unit and interval\n"
      "  rxt             reflectance and transmittance of flat samples, as iad reads them\n\n"
      "Example:\n"
      "  crownfit export result/material.json --to blender --capture crown -o blender\n"
      "  blender --background --python blender/crown.py -- front\n"
      "The first word after -- names the photograph to set up.");
  exported->add_option("MATERIAL", asked->material, "material.json of a fit, or truth.json.")->required();
  std::vector<std::string> formats;
  for (const auto& [name, exporter] : Exporters()) formats.push_back(name);
  exported->add_option("--to", asked->options.format, "Format to write; listed below.")
      ->required()
      ->check(CLI::IsMember(formats));
  exported->add_option("--capture", asked->options.capture,
                       "Add shape, lamps, cameras and path-traced reference pictures from this capture:\n"
                       "a folder that holds capture.json, or that file.");
  exported
      ->add_option("--paths", asked->options.paths_per_pixel,
                   "Paths per pixel of the reference pictures (default 256).")
      ->check(CLI::Range(2, 100000000));
  exported->add_option("-o,--output", asked->output, "Folder for the files; it is created if missing.")->required();
  exported->add_option("--seed", asked->options.seed, "Seed of the reference pictures (default 1).");
  AddCommonOptions(exported, asked->common);
  RunWith(exported, command, asked, RunExport);
}

}  // namespace crownfit
