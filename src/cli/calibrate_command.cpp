#include "cli/calibrate_parts.h"

namespace crownfit {

void AddCalibrate(CLI::App& app, Command& command) {
  auto* calibrate = app.add_subcommand(
      "calibrate",
      "Makes what a capture needs from photographs: each command writes one file, prints how good it is, draws a\n"
      "picture of it, and writes nothing when it is not good enough (exit code 1). docs/calibration.md walks through.");
  calibrate->require_subcommand(1);
  for (const auto add : {AddCalibrateCamera, AddCalibrateNoise, AddCalibrateExposures, AddCalibrateBlur,
                         AddCalibrateColour, AddCalibratePose, AddCalibrateLights, AddCalibrateTarget})
    add(*calibrate, command);
}

}  // namespace crownfit
