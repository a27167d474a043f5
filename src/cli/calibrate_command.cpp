#include "cli/calibrate_parts.h"

namespace crownfit {

void AddCalibrate(CLI::App& app, Command& command) {
  auto* calibrate = app.add_subcommand("calibrate", "Makes the calibration files of a capture from photographs.");
  calibrate->require_subcommand(1);
  calibrate->footer(
      "Each command writes one file, prints figures of its quality, and draws a picture to look at. If the quality is "
      "too low,\n"
      "it writes no file and exits with 1. docs/calibration.md shows all commands in order.\n\n"
      "Example:\n"
      "  crownfit calibrate target charuco --corners 9x6 --square-mm 10 -o board.svg\n"
      "  crownfit calibrate camera board*.dng --board charuco --corners 9x6 --square-mm 10 -o camera.json");
  for (const auto add : {AddCalibrateCamera, AddCalibrateNoise, AddCalibrateExposures, AddCalibrateBlur,
                         AddCalibrateColour, AddCalibratePose, AddCalibrateLights, AddCalibrateTarget})
    add(*calibrate, command);
}

}  // namespace crownfit
