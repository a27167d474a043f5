#include "cli/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>

namespace crownfit {
namespace {

constexpr void (*kCommands[])(CLI::App&, Command&) = {
    AddFit,    AddReport,  AddCheck,  AddRender,    AddView,  AddMatch,      AddCalibrate, AddCapture,
    AddExport, AddPredict, AddShades, AddBenchmark, AddBatch, AddSynthesize, AddSlab,      AddCompare};

/// The first option with `nan` or infinity for a number: CLI11's own range checks let `nan` pass.
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

/// Letters to add, drop, change or swap with a neighbour, so that one word becomes the other (Damerau 1964,
/// restricted).
size_t EditDistance(const std::string& a, const std::string& b) {
  std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i)
    for (size_t k = 0; k <= b.size(); ++k) {
      if (i == 0 || k == 0) {
        d[i][k] = i + k;
        continue;
      }
      d[i][k] = std::min({d[i - 1][k] + 1, d[i][k - 1] + 1, d[i - 1][k - 1] + (a[i - 1] != b[k - 1])});
      if (i > 1 && k > 1 && a[i - 1] == b[k - 2] && a[i - 2] == b[k - 1])
        d[i][k] = std::min(d[i][k], d[i - 2][k - 2] + 1);
    }
  return d[a.size()][b.size()];
}

std::string NotKnown(const std::string& what, const std::string& word, const std::vector<std::string>& known) {
  const auto nearest = std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return EditDistance(word, a) < EditDistance(word, b);
  });
  const bool is_near = nearest != known.end() && EditDistance(word, *nearest) <= std::max<size_t>(2, word.size() / 3);
  return "there is no " + what + " '" + word + "'" + (is_near ? "; did you mean '" + *nearest + "'?" : "") + "\n";
}

/// What is wrong with the first command or option that does not exist, and where help on it is; empty where all exist.
std::string FirstUnknown(const CLI::App& program, int argc, char** argv) {
  const CLI::App* app = &program;
  std::string path = "crownfit";
  int i = 1;
  const auto with_help = [&](const std::string& what) { return what + "  `" + path + " --help` lists them.\n"; };
  for (; i < argc && app->get_require_subcommand_min() > 0 && argv[i][0] != '-'; ++i) {
    const auto commands = app->get_subcommands([](const CLI::App*) { return true; });
    std::vector<std::string> names;
    for (const CLI::App* command : commands) names.push_back(command->get_name());
    const auto found = std::find(names.begin(), names.end(), argv[i]);
    if (found == names.end()) return with_help(NotKnown("command", argv[i], names));
    app = commands[static_cast<size_t>(found - names.begin())];
    path += std::string(" ") + argv[i];
  }
  std::vector<std::string> options;
  for (const CLI::Option* option : app->get_options())
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  for (; i < argc && std::string(argv[i]) != "--"; ++i) {
    const std::string word = argv[i], name = word.substr(0, word.find('='));
    if (name.starts_with("--") && std::find(options.begin(), options.end(), name) == options.end())
      return with_help(NotKnown("option", name, options));
  }
  return "";
}

}  // namespace

Command ParseCommandLine(int argc, char** argv) {
  Command command;
  command.program = argv[0];
  for (int i = 0; i < argc; ++i) command.line += (i ? " " : "") + std::string(argv[i]);
  CLI::App app{
      "Fits the optical materials of dental crowns and teeth to calibrated photographs.\n\n"
      "  crownfit check CAPTURE                 checks a capture and foresees what a fit would find\n"
      "  crownfit fit CAPTURE -o RESULT         fits scattering, absorption, thickness, roughness, with intervals\n"
      "  crownfit report RESULT                 writes the page of a result, report.html, again\n"
      "  crownfit batch MANIFEST -o DIR         fits hundreds of crowns in parallel and resumes after a stop\n"
      "  crownfit render CAPTURE -o DIR         renders the photographs that a material predicts\n"
      "  crownfit view M --capture CAPTURE      shows the crown in a window: turn it, light it, change its material\n"
      "  crownfit match M --capture C -o M2     finds parameters with which the viewer looks like path tracing\n"
      "  crownfit synthesize RECIPE -o CAPTURE  path-traces photographs of a known material\n"
      "  crownfit predict M                     predicts colour and translucency at any thickness, over any stump\n"
      "  crownfit shades ...                    makes your own set of shade tabs and finds the nearest ones\n"
      "  crownfit slab SLAB.json                computes reflectance and transmittance of a flat layered sample\n"
      "  crownfit calibrate WHAT IMAGES         calibrates camera, noise, blur, colour, lights and poses\n"
      "  crownfit capture init ...              gathers meshes, photographs and calibration into a capture\n"
      "  crownfit export M --to FORMAT -o DIR   writes files for Mitsuba, pbrt, Blender, glTF, MaterialX, iad; CSV\n"
      "  crownfit compare A B                   measures CIEDE2000 between two pictures\n"
      "  crownfit benchmark tradeoff C -o DIR   measures speed against accuracy of every model\n\n"
      "CAPTURE and C are a folder that holds capture.json, or that file (docs/file_formats.md).\n"
      "M is the material.json of a fit, or a truth.json. `crownfit COMMAND --help` shows options and an example.\n"
      "Exit codes: 0 done; 1 finished, but do not use the result (the reasons are printed); 2 wrong input;\n"
      "3 interrupted; 4 internal error; 75 batch stopped by SIGTERM."};
  app.name("crownfit");
  app.require_subcommand(1);
  app.set_version_flag("--version", "crownfit " CROWNFIT_VERSION);
  app.failure_message(CLI::FailureMessage::simple);
  for (const auto add : kCommands) add(app, command);
  for (CLI::App* listed : app.get_subcommands({})) listed->group("");  // the text above lists them
  if (argc == 1) {
    command.run = [help = app.help()] {
      std::fputs(help.c_str(), stdout);
      return 2;
    };
    return command;
  }
  try {
    app.parse(argc, argv);
    if (const CLI::Option* option = NotFinite(app))
      throw CLI::ValidationError(option->get_name(), "is not a finite number. Write one such as 0.5 or 1e-3.");
  } catch (const CLI::ParseError& e) {
    const std::string unknown = e.get_exit_code() == 0 ? "" : FirstUnknown(app, argc, argv);
    if (!unknown.empty()) std::cerr << "crownfit: " << unknown;
    const int code = !unknown.empty() || app.exit(e, std::cout, std::cerr) != 0 ? 2 : 0;
    command.run = [code] { return code; };
  }
  return command;
}

}  // namespace crownfit
