#pragma once
// The part of the window that shows the crown: mouse input, names of the panes, legends.

#include "viewer/display.h"
#include "viewer/panel.h"

namespace crownfit {

/// Mouse input of one frame, in the window's own pixels.
struct ViewInput {
  glm::dvec2 orbit{0.0}, lamps{0.0}, pan{0.0};
  double wheel = 0;
  glm::dvec2 at{0.0};        ///< pointer position within its pane
  glm::dvec2 pane{1.0};      ///< the pane's size
  bool turns_lamps = false;  ///< a drag of the lamps is in progress
};

/// The panes of the chosen view side by side in a part of the window.
std::vector<Pane> PanesOf(const PanelState& state, glm::ivec2 corner, glm::ivec2 size);

ViewInput DrawViewArea(PanelState& state, const Rectangle& area, const std::vector<Pane>& panes, double pixels_per_unit,
                       Layout& layout);

}  // namespace crownfit
