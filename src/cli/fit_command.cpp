#include "cli/fit_command.h"

#include <chrono>
#include <cstdio>

#include "base/error.h"
#include "base/files.h"
#include "cli/fit_options_line.h"
#include "cli/report_command.h"
#include "fit_together.h"
#include "plan/fit_plan.h"
#include "report/summary.h"

namespace crownfit {
namespace {

struct FitCommand {
  std::vector<std::filesystem::path> captures;
  std::filesystem::path output;
  FitText text;
  bool json = false;
  CommonOptions common;
  std::string line;  ///< the whole command line, for run.json
};

int RunFit(const FitCommand& asked) {
  const auto begin = std::chrono::steady_clock::now();
  Progress progress(asked.common.progress);
  std::vector<Capture> captures;
  for (const auto& file : asked.captures) captures.push_back(ReadCapture(file));
  MakeFolder(asked.output);
  FitOptions options = FitOptionsOf(asked.text);
  options.threads = asked.common.threads;
  if (options.is_planned()) {
    options = WithPlan(options, PlanFit(captures, options, progress));
    progress.Clear();
    std::fprintf(stderr, "Plan: %s.\n", options.model_choice.c_str());
  }
  const std::vector<CrownFit> fits = FitTogether(captures, options, progress);
  const CrownFit fit = Joined(fits);
  progress.Clear();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - begin;
  const RunRecord run{asked.line, asked.common.threads, wall.count()};
  for (size_t i = 0; i < fit.together.size(); ++i)
    WriteResultWithPage(asked.output / "captures" / fit.together[i].name, fits[i], run, options.threads, progress);
  WriteResultWithPage(asked.output, fit, run, options.threads, progress);
  progress.Clear();
  PrintNotes(fit.messages);
  if (asked.json) {
    std::fputs(MaterialJson(fit).c_str(), stdout);
  } else {
    std::fputs(Summary(fit).c_str(), stdout);
    std::printf("\nWritten: %s (report.html, material.json, run.json%s) in %.1f s\n", asked.output.c_str(),
                fit.photographs.empty() ? "" : ", figures/", wall.count());
  }
  return fit.usable ? 0 : 1;
}

CLI::App* AddFitCommand(CLI::App& app, FitCommand& asked) {
  auto* fit = app.add_subcommand(
      "fit", "Fits the material of a capture. Writes report.html, material.json, run.json and figures/.");
  fit->footer(
      "Example:\n"
      "  crownfit fit crown -o result --fix enamel.ior=1.63\n"
      "Prints whether the result is usable, and every value with its 95 % interval. Open result/report.html in a "
      "browser.");
  fit->add_option("CAPTURE", asked.captures,
                  "Folder that holds capture.json, or that file. Several captures of one material (discs of\n"
                  "several thicknesses, crowns from one blank) are fitted together: layers of the same name\n"
                  "share everything but their thickness. RESULT/captures/ then holds a result for each.")
      ->required();
  fit->add_option("-o,--output", asked.output, "Folder for the result; it is created if missing.")->required();
  AddFitOptions(fit, asked.text);
  fit->add_flag("--json", asked.json, "Print material.json instead of the summary.");
  AddCommonOptions(fit, asked.common);
  return fit;
}

}  // namespace

void AddFit(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<FitCommand>();
  asked->line = command.line;
  RunWith(AddFitCommand(app, *asked), command, asked, RunFit);
}

namespace {

/// Nothing where there is none, or one with a fault, which its own fit will name.
std::optional<Capture> ReadableCapture(const std::filesystem::path& file) {
  if (file.empty()) return std::nullopt;
  try {
    return ReadCapture(file);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

}  // namespace

std::string FaultOfFit(const std::vector<std::string>& fit_arguments, const std::filesystem::path& capture_file) {
  CLI::App app;
  FitCommand asked;
  AddFitCommand(app, asked);
  std::vector<std::string> backwards(fit_arguments.rbegin(), fit_arguments.rend());
  backwards.insert(backwards.end(), {"RESULT", "-o", "CAPTURE", "fit"});
  try {
    app.parse(backwards);
    const FitOptions options = FitOptionsOf(asked.text);
    if (std::optional<Capture> capture = ReadableCapture(capture_file)) ApplyOverrides(*capture, options.overrides);
  } catch (const CLI::ParseError& e) {
    return e.what();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

}  // namespace crownfit
