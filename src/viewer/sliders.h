#pragma once
// The sliders of the material.

#include "viewer/layout.h"
#include "viewer/panel_state.h"

namespace crownfit {

/// Draws all groups; `answer` records changes.
void DrawSliders(PanelState& state, PanelAnswer& answer, Layout& layout);

/// Which end of the 95 % interval a number goes to.
enum class End { kLow, kBest, kHigh };
void GoTo(End end, SliderParameter& parameter);

}  // namespace crownfit
