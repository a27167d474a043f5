#include "cli/report_command.h"

#include <cstdio>

#include "base/error.h"
#include "base/files.h"
#include "capture/capture.h"
#include "capture/colour_file.h"
#include "cli/lay_up_options.h"
#include "dental/prediction_file.h"
#include "report/report_files.h"

namespace crownfit {
namespace {

struct ReportCommand {
  std::filesystem::path result;
  LayUp lay_up;
  bool lays_up_anew = false;  ///< an option of the flat piece was given
  CommonOptions common;
};

/// Writes the camera's colours, if the capture states them; a white surface appears white.
void WriteColour(const std::filesystem::path& folder, const Capture& capture) {
  for (const PhotographSpec& p : capture.photographs) {
    if (!p.has_colour_file) continue;
    const Spectrum white = BandColour{p.rgb_from_sensor}.Reflectance(glm::dvec3(1.0), capture.channels());
    JsonValue::Object content{{"format", "crownfit-colour/1"}};
    for (auto& member : ColourContent({p.rgb_from_sensor, white})) content.push_back(std::move(member));
    return WriteTextFile(folder / "colour.json", ToJsonText(content));
  }
}

int RunReport(const ReportCommand& asked) {
  if (asked.lays_up_anew) {
    Progress progress(asked.common.progress);
    LayUp lay_up = asked.lay_up;
    lay_up.threads = asked.common.threads;
    WritePrediction(lay_up, asked.result, progress);
  }
  std::printf("%s\n", WriteReportPage(asked.result).c_str());
  return 0;
}

}  // namespace

void WriteResultWithPage(const std::filesystem::path& folder, const CrownFit& fit, const RunRecord& run, int threads,
                         Progress& progress) {
  WriteColour(folder, fit.capture);
  WriteResult(folder, fit, run);
  try {
    LayUp lay_up;
    lay_up.threads = threads;
    WritePrediction(lay_up, folder, progress);
  } catch (const InputError& e) {
    WriteWhyNoPrediction(folder, e.what());
  }
  WriteReportPage(folder);
}

void AddReport(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<ReportCommand>();
  auto* report = app.add_subcommand("report", "Writes the page of a result, report.html, again.");
  report->footer(
      "`crownfit fit` writes the same page. With an option from --thickness to --tabs, the flat piece on the page is\n"
      "computed again; `fit` lays it over black. docs/report.md explains the page.\n\n"
      "Example:\n"
      "  crownfit report result --stump 60,2,18 --tabs tabs.json\n"
      "Open result/report.html in a browser; it needs no network.");
  report->add_option("RESULT", asked->result, "Folder that `crownfit fit` wrote. It may have been moved.")->required();
  AddLayUp(report, asked->lay_up);
  AddTargets(report, asked->lay_up);
  report->add_option(
      "--tabs", asked->lay_up.tabs,
      "Set of tabs from `crownfit shades`. The page names the three nearest; tab:NAME refers to it too.");
  std::vector<const CLI::Option*> of_piece;
  for (const CLI::Option* option : report->get_options())
    if (!option->get_positional() && option != report->get_help_ptr()) of_piece.push_back(option);
  AddCommonOptions(report, asked->common);
  report->final_callback([=, &command] {
    for (const CLI::Option* option : of_piece) asked->lays_up_anew |= option->count() > 0;
    command.run = [=] { return RunReport(*asked); };
  });
}

}  // namespace crownfit
