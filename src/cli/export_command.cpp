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
      "A material as files of another program, with a README of what became of which quantity and what is lost.\n"
      "  mitsuba, pbrt   media and boundaries of every layer; with --capture a scene for every photograph\n"
      "  blender         a Python script: subsurface in one medium, or every layer a volume; with --capture the scene\n"
      "  gltf            crown.glb for viewers; with --capture the crown's surface\n"
      "  materialx       OpenPBR subsurface, of all layers as one and of every layer\n"
      "  csv             every value with unit and interval\n"
      "  rxt             reflectance and transmittance of flat samples, as iad reads them");
  exported->add_option("MATERIAL", asked->material, "material.json or truth.json.")->required();
  std::vector<std::string> formats;
  for (const auto& [name, exporter] : Exporters()) formats.push_back(name);
  exported->add_option("--to", asked->options.format, "Whose files.")->required()->check(CLI::IsMember(formats));
  exported->add_option("--capture", asked->options.capture,
                       "Adds shape, lamps, cameras, and reference pictures by random walks: folder with capture.json, "
                       "or that file.");
  exported
      ->add_option("--paths", asked->options.paths_per_pixel,
                   "Paths per pixel of the reference pictures (default 256).")
      ->check(CLI::Range(2, 100000000));
  exported->add_option("-o,--output", asked->output, "Folder for the files (made when missing).")->required();
  exported->add_option("--seed", asked->options.seed, "Seed of the reference pictures (default 1).");
  AddCommonOptions(exported, asked->common);
  RunWith(exported, command, asked, RunExport);
}

}  // namespace crownfit
