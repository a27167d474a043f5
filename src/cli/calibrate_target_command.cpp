#include <cstdio>

#include "base/error.h"
#include "base/files.h"
#include "calibration/printed_targets.h"
#include "cli/calibrate_parts.h"

namespace crownfit {
namespace {

struct TargetTask {
  std::filesystem::path output;
  BoardOptions board;     ///< includes kind jig
  double inside_mm = 16;  ///< of a jig: inner width, for the crown
};

int RunTarget(const TargetTask& asked) {
  if (asked.output.extension() != ".svg")
    throw InputError(asked.output, "-o", "a target is written as SVG: give a name that ends in .svg");
  if (asked.board.kind != "jig") {
    WriteTextFile(asked.output, SvgText(PrintedBoard(BoardOf(asked.board))));
  } else {
    JigLayout layout{.inside_mm = asked.inside_mm};
    if (!asked.board.board.dictionary.empty()) layout.dictionary = asked.board.board.dictionary;
    if (asked.board.board.marker_mm > 0) layout.marker_mm = asked.board.board.marker_mm;
    WriteTextFile(asked.output, SvgText(PrintedJig(layout)));
    WriteTextFile(std::filesystem::path(asked.output).replace_extension(".json"), ToJsonText(JigJson(JigOf(layout))));
  }
  std::printf("Written: %s. Print it at 100 %% on matt paper, and measure the print.\n", asked.output.c_str());
  return 0;
}

}  // namespace

void AddCalibrateTarget(CLI::App& calibrate, Command& command) {
  const auto asked = std::make_shared<TargetTask>();
  auto* target =
      calibrate.add_subcommand("target", "Draws a target to print, as SVG in mm; for a jig also its markers as JSON.");
  target->footer(
      "Example:\n"
      "  crownfit calibrate target charuco --corners 9x6 --square-mm 10 -o board.svg\n"
      "  crownfit calibrate target jig -o jig.svg\n"
      "The first draws a board for `calibrate camera`, the second a jig for poses and blur, with jig.json.");
  target->add_option("KIND", asked->board.kind, "chessboard, charuco, apriltag, or jig (markers around a crown).")
      ->required();
  target
      ->add_option("-o,--output", asked->output,
                   "SVG file to write. The markers of a jig are written beside it, with .json.")
      ->required();
  AddBoard(target, asked->board);
  target->add_option("--inside-mm", asked->inside_mm, "jig: width of the free place for the crown in mm (default 16).")
      ->check(CLI::PositiveNumber);
  RunWith(target, command, asked, RunTarget);
}

}  // namespace crownfit
