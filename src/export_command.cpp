#include <CLI/CLI.hpp>
#include <cstdio>

#include "command_line_parts.h"
#include "commands.h"
#include "exchange/exporters.h"
#include "export_material.h"

namespace crownfit {

void AddExport(CLI::App& app, CommandLine& line) {
  auto* command = app.add_subcommand(
      "export",
      "A material as files of another program, with a README of what became of which quantity and what is lost.\n"
      "  mitsuba, pbrt   media and boundaries of every layer; with --capture a scene for every photograph\n"
      "  blender         a Python script: subsurface in one medium, or every layer a volume; with --capture the scene\n"
      "  gltf            crown.glb for viewers; with --capture the crown's surface\n"
      "  materialx       OpenPBR subsurface, of all layers as one and of every layer\n"
      "  csv             every value with unit and interval\n"
      "  rxt             reflectance and transmittance of flat samples, as iad reads them");
  command->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  std::vector<std::string> formats;
  for (const auto& [name, exporter] : Exporters()) formats.push_back(name);
  command->add_option("--to", line.exported.format, "Whose files.")->required()->check(CLI::IsMember(formats));
  command->add_option("--capture", line.exported.capture,
                      "Adds shape, lamps, cameras, and reference pictures by random walks: folder with capture.json, "
                      "or that file.");
  command
      ->add_option("--paths", line.exported.paths_per_pixel, "Paths per pixel of the reference pictures (default 256).")
      ->check(CLI::Range(2, 100000000));
  command->add_option("-o,--output", line.output, "Folder for the files (made when missing).")->required();
  command->add_option("--seed", line.fit.seed, "Seed of the reference pictures (default 1).");
  AddCommonOptions(command, line);
}

int RunExport(const CommandLine& line) {
  ExportOptions options = line.exported;
  options.seed = line.fit.seed;
  options.threads = line.fit.threads;
  Progress progress(line.progress);
  const auto said = ExportMaterial(line.material, options, line.output, progress);
  progress.Clear();
  for (const auto& words : said) std::fprintf(stderr, "note: %s\n", words.c_str());
  std::printf("%s\n", (line.output / "README.md").c_str());
  return 0;
}

}  // namespace crownfit
