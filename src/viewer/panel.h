#pragma once
// The window's panel, drawn by Dear ImGui.

#include <vector>

#include "viewer/layout.h"
#include "viewer/panel_state.h"

namespace crownfit {

/// In ImGui's units, from the top left.
struct Rectangle {
  float x, y, width, height;
};

float PanelWidth();
PanelAnswer DrawPanel(PanelState& state, const Rectangle& area, Layout& layout);
/// Applies shortcuts; draws the window that lists them.
void ApplyKeys(const std::vector<unsigned>& keys, PanelState& state, PanelAnswer& answer);
void DrawHelp(PanelState& state);

}  // namespace crownfit
