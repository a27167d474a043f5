#pragma once
// The part of the window that shows the crown: what the mouse does there, names of the panes, legends.

#include "viewer/display.h"
#include "viewer/panel.h"

namespace crownfit {

/// What the mouse did in one frame, in the window's own pixels.
struct ViewInput {
  glm::dvec2 orbit{0.0}, lamps{0.0}, pan{0.0};
  double wheel = 0;
  glm::dvec2 at{0.0};        ///< of the pointer, within its pane
  glm::dvec2 pane{1.0};      ///< the pane's size
  bool turns_lamps = false;  ///< such a drag goes on
};

/// The panes of the chosen view side by side in a part of the window.
std::vector<Pane> PanesOf(const PanelState& state, glm::ivec2 corner, glm::ivec2 size);

ViewInput DrawViewArea(PanelState& state, const Rectangle& area, const std::vector<Pane>& panes, double pixels_per_unit,
                       Layout& layout);

}  // namespace crownfit
