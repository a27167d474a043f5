#include "command_line.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <sstream>

#include "batch_command_line.h"
#include "command_line_parts.h"
#include "fit_command_line.h"

namespace crownfit {
namespace {

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

/// Parses; complaints go to `errors`, with the command's help unless they are to be `brief`.
CommandLine Parse(const std::vector<std::string>& arguments, std::ostream& errors, bool brief) {
  CommandLine line;
  for (const auto& a : arguments) line.text += (line.text.empty() ? "" : " ") + a;

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

  FitText text;
  auto* fit = app.add_subcommand(
      "fit", "Fits the material of a capture; writes report.html, material.json, run.json and figures/.");
  fit->add_option(
         "CAPTURE", text.captures,
         "Folder with capture.json, or that file. Several: they show one material (discs of several\n"
         "thicknesses, crowns from one blank) and are fitted together; layers of the same name share everything\n"
         "but their thickness. RESULT/captures/ then holds a result for each.")
      ->required();
  fit->add_option("-o,--output", line.output, "Folder for the result (made when missing).")->required();
  const std::vector<CLI::Option*> fit_options = AddFitOptions(fit, line, text);
  fit->add_flag("--json", line.json, "Print material.json on stdout in place of the summary.");
  AddCommonOptions(fit, line);

  AddReport(app, line);

  auto* check = app.add_subcommand(
      "check",
      "Reads a capture with all its files and says whether it can be fitted, what its photographs would tell of every "
      "free number, what the scene requires, and which photograph to take next; fits nothing.");
  check->add_option("CAPTURE", line.capture, "Folder with capture.json, or that file.")->required();
  check->add_option("-o,--output", line.output, "PNG with slices through the layers, to look at.");
  check->add_flag("--json", line.json, "Print JSON.");
  AddCommonOptions(check, line);

  auto* render =
      app.add_subcommand("render", "Predicts the photographs of a capture with a material (EXR, and PNG to look at).");
  render->add_option("CAPTURE", line.capture, "Folder with capture.json, or that file. Its photographs need not exist.")
      ->required();
  render->add_option("--material", line.material, "material.json or truth.json; default: the capture's own values.");
  render->add_option("-o,--output", line.output, "Folder for the pictures.")->required();
  render->add_option("--model", line.fit.model,
                     "shader: the real-time terms, seconds. path: random walks, the reference; with a variance layer.\n"
                     "diffusion: walks of --collisions, then diffusion in the crown's volume: less noise.");
  AddCollisions(render, line);
  render->add_option("--paths", line.paths, "Paths per pixel of models path and diffusion (default 256).")
      ->check(CLI::Range(1, 100000000));
  render->add_option("--photograph", line.photograph, "Only this one.");
  render
      ->add_option("--noise", line.noise, "Add relative noise of this standard deviation (0.01: 1 %), keyed by --seed.")
      ->check(CLI::Range(0.0, 1.0));
  render->add_flag("--derivatives", line.derivatives,
                   "Models path and diffusion: also PHOTOGRAPH_derivatives.exr, derivatives by scattering, absorption, "
                   "g, index and so on.");
  render->add_flag("--half", line.half_float, "16-bit EXR.");
  render->add_flag("--twelve-taps", line.fit.twelve_taps, "Blur by the thesis's 1 + 12 taps in place of 49.");
  render->add_flag("--fine", line.fine, "Four times the light samples.");
  render->add_option("--scale", line.scale, "Pictures of so many times the camera's width and height (default 1).")
      ->check(CLI::Range(0.01, 1.0));
  render->add_option("--seed", line.fit.seed, "Seed of the noise and of model path's walks (default 1).");
  AddCommonOptions(render, line);

  AddView(app, line);
  AddMatch(app, line);
  AddCalibrate(app, line);
  AddCapture(app, line);
  AddExport(app, line);
  AddPredict(app, line);
  AddShades(app, line);
  AddBenchmark(app, line);
  BatchWords words;
  const CLI::App* batch = AddBatch(app, line, text, words);

  auto* synthesize = app.add_subcommand(
      "synthesize", "Path-traces a capture with a known answer: photographs, calibration, meshes, truth.json.");
  synthesize->add_option("RECIPE", line.capture, "recipe.json (docs/file_formats.md).")->required();
  synthesize->add_option("-o,--output", line.output, "Folder for the capture (made when missing).")->required();
  AddCommonOptions(synthesize, line);

  auto* slab = app.add_subcommand("slab", "Reflectance and transmittance of a flat layered sample, as JSON.");
  slab->add_option("SLAB", line.capture, "slab.json (docs/file_formats.md).")->required();
  slab->add_option(
      "--model", line.fit.model,
      "layered: adding-doubling, exact, milliseconds (default). path: random walks, with errors and rings. "
      "shader, diffusion: what those models of crowns make of it, to see how far they are off.");
  slab->add_option("--photons", line.photons,
                   "Photons of models path and diffusion at normal incidence (default 1000000); a quarter as many come "
                   "diffusely.")
      ->check(CLI::Range(uint64_t{2}, uint64_t{1000000000000}));
  slab->add_option("--seed", line.fit.seed, "Seed of models path and diffusion (default 1).");
  AddCollisions(slab, line);
  AddCommonOptions(slab, line);

  auto* compare =
      app.add_subcommand("compare", "CIEDE2000 (D65, 2 degrees) between two linear pictures, over 8 x 8 blocks.");
  compare->add_option("IMAGE_A", line.image_a, "The photograph; sets the common brightness.")->required();
  compare->add_option("IMAGE_B", line.image_b, "What to compare with it.")->required();
  compare->add_option("--mask", line.mask, "Compare where this picture is above 0.5.");
  compare->add_option("-o,--output", line.output, "PNG map of the differences.");
  compare->add_flag("--json", line.json, "Print JSON.");

  try {
    std::vector<std::string> backwards(arguments.rbegin(), arguments.rend() - 1);
    app.parse(backwards);
    if (const CLI::Option* option = NotFinite(app))
      throw CLI::ValidationError(option->get_name(), "is no finite number. Write one, as 0.5 or 1e-3.");
  } catch (const CLI::ParseError& e) {
    if (brief) errors << e.what() << "\n";
    const int code = brief ? e.get_exit_code() : app.exit(e, std::cout, errors);
    line.exit_code = code == 0 ? 0 : 2;
    return line;
  }
  line.command = app.get_subcommands().front()->get_name();
  if (line.command == "calibrate")
    line.calibrate.task = app.get_subcommands().front()->get_subcommands().front()->get_name();
  if (line.command == "shades") line.shades.task = app.get_subcommands().front()->get_subcommands().front()->get_name();
  if (slab->parsed() && slab->count("--model") == 0) line.fit.model = "layered";
  if (render->parsed() && render->count("--model") == 0) line.fit.model = "shader";
  const auto complain = [&](const std::string& message) {
    errors << (brief ? "" : "crownfit: ") << message << "\n";
    line.exit_code = 2;
  };
  line.captures.assign(text.captures.begin(), text.captures.end());
  const std::map<std::string, std::vector<std::string>> models{
      {"fit", {"auto", "shader", "diffusion", "path", "layered"}},
      {"batch", {"auto", "shader", "diffusion", "path", "layered"}},
      {"render", {"shader", "path", "diffusion"}},
      {"slab", {"layered", "path", "shader", "diffusion"}}};
  if (const auto known = models.find(line.command); known != models.end()) {
    const auto& names = known->second;
    if (std::find(names.begin(), names.end(), line.fit.model) == names.end()) {
      std::string list;
      for (const auto& name : names) list += (list.empty() ? "" : ", ") + name;
      complain("--model " + line.fit.model + ": " + line.command + " of this version has: " + list + ".");
    }
  }
  constexpr int kFewestForDerivatives = 16;
  if (line.derivatives && (line.fit.model == "shader" || line.paths < kFewestForDerivatives))
    complain(
        "--derivatives: only with --model path or diffusion, and at least 16 --paths: their errors are found from "
        "groups.");
  TakeFitText(text, complain, line);
  TakeBatch(batch, fit_options, arguments[0], words, complain, line);
  return line;
}

}  // namespace

std::string FaultOfFit(const std::vector<std::string>& fit_arguments) {
  std::vector<std::string> arguments{"crownfit", "fit", "CAPTURE", "-o", "RESULT"};
  arguments.insert(arguments.end(), fit_arguments.begin(), fit_arguments.end());
  std::ostringstream errors;
  Parse(arguments, errors, /*brief=*/true);
  std::string fault = errors.str();
  while (!fault.empty() && fault.back() == '\n') fault.pop_back();
  return fault;
}

void AddCommonOptions(CLI::App* app, CommandLine& line) {
  app->add_option("--threads", line.fit.threads, "Threads to use; 0: one per processor. Results do not depend on it.")
      ->check(CLI::Range(0, 1024));
  app->add_option("--progress", line.progress, "auto: a bar when stderr is a terminal; none; json: lines on stderr.")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ProgressMode>{
          {"auto", ProgressMode::kAuto}, {"none", ProgressMode::kNone}, {"json", ProgressMode::kJson}}));
}

CommandLine ParseCommandLine(int argc, char** argv) {
  return Parse(std::vector<std::string>(argv, argv + argc), std::cerr, /*brief=*/false);
}

}  // namespace crownfit
