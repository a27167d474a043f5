#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>

namespace crownfit {
namespace {

constexpr void (*kCommands[])(CLI::App&, Command&) = {
    AddFit,    AddReport,  AddCheck,  AddRender,    AddView,  AddMatch,      AddCalibrate, AddCapture,
    AddExport, AddPredict, AddShades, AddBenchmark, AddBatch, AddSynthesize, AddSlab,      AddCompare};

/// CLI11's own checks of a range let `nan` pass. The first option that has it, or infinity, for a number.
const CLI::Option* NotFinite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_type_name().find("FLOAT") == std::string::npos) continue;
    for (const std::string& text : option->results())
      if (!std::isfinite(std::strtod(text.c_str(), nullptr))) return option;
  }
  for (const CLI::App* command : app.get_subcommands())
    if (const CLI::Option* option = NotFinite(*command)) return option;
  return nullptr;
}

}  // namespace

Command ParseCommandLine(int argc, char** argv) {
  Command command;
  command.program = argv[0];
  for (int i = 0; i < argc; ++i) command.line += (i ? " " : "") + std::string(argv[i]);
  CLI::App app{
      "Fits the materials of dental crowns and teeth to calibrated photographs.\n\n"
      "  crownfit check CAPTURE                 complete and consistent? what will it tell, what to photograph next?\n"
      "  crownfit fit CAPTURE -o RESULT         scattering, absorption, thickness, roughness, with error bars\n"
      "  crownfit report RESULT                 the page of a result again: report.html\n"
      "  crownfit batch MANIFEST -o DIR         hundreds of crowns: parallel, resumable, with a summary\n"
      "  crownfit render CAPTURE --material M   the photographs a material predicts\n"
      "  crownfit view M --capture CAPTURE      the crown in a window: turn it, light it, change the material\n"
      "  crownfit match M --capture C -o M2     effective parameters that make the viewer look like path tracing\n"
      "  crownfit synthesize RECIPE -o CAPTURE  path-traced photographs with a known answer\n"
      "  crownfit predict MATERIAL              its colour and translucency at other thicknesses, over other stumps\n"
      "  crownfit shades ...                    your own shade tabs, and the nearest to a material\n"
      "  crownfit slab SLAB.json                reflectance and transmittance of a flat layered sample\n"
      "  crownfit calibrate WHAT IMAGES         camera, noise, blur, colour, lights and poses from photographs\n"
      "  crownfit capture init ...              meshes, photographs and calibration gathered into a capture\n"
      "  crownfit export M --to FORMAT -o DIR   for Mitsuba, pbrt, Blender, glTF, MaterialX, or as a table\n"
      "  crownfit compare A B                   CIEDE2000 between two pictures\n"
      "  crownfit benchmark tradeoff C -o DIR   speed against accuracy of every model, on your capture\n\n"
      "CAPTURE is a folder that holds capture.json, or that file. docs/file_formats.md describes it.\n"
      "Exit codes: 0 done; 1 finished, but the result must not be used (reasons are printed); 2 wrong input;\n"
      "3 interrupted; 4 internal error; 75 batch stopped by SIGTERM."};
  app.name("crownfit");
  app.require_subcommand(1);
  app.set_version_flag("--version", "crownfit " CROWNFIT_VERSION);
  app.failure_message(CLI::FailureMessage::help);
  for (const auto add : kCommands) add(app, command);
  try {
    app.parse(argc, argv);
    if (const CLI::Option* option = NotFinite(app))
      throw CLI::ValidationError(option->get_name(), "is no finite number. Write one, as 0.5 or 1e-3.");
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e, std::cout, std::cerr) == 0 ? 0 : 2;
    command.run = [code] { return code; };
  }
  return command;
}

}  // namespace crownfit
