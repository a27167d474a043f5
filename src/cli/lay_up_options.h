#pragma once
// How a material is made into a flat piece, measured and compared: options of `predict`, `report` and `shades`.

#include "cli/common_options.h"
#include "dental/lay_up.h"

namespace crownfit {

/// Options for its layers and the measurement.
void AddLayUp(CLI::App* app, LayUp& lay_up);

/// Options for its intervals.
void AddDraws(CLI::App* app, LayUp& lay_up);

/// Options for the targets it is compared with.
void AddTargets(CLI::App* app, LayUp& lay_up);

}  // namespace crownfit
