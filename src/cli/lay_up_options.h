#pragma once
// How a material is laid up as a flat piece, measured and compared: options of `predict`, `report` and `shades`.

#include "cli/common_options.h"
#include "dental/lay_up.h"

namespace crownfit {

/// What it is made of and how it is measured.
void AddLayUp(CLI::App* app, LayUp& lay_up);

/// How intervals are found.
void AddDraws(CLI::App* app, LayUp& lay_up);

/// What it is compared with.
void AddTargets(CLI::App* app, LayUp& lay_up);

}  // namespace crownfit
