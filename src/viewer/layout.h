#pragma once
// Positions of widgets by name, so that a test can find them.

#include <string>
#include <vector>

namespace crownfit {

struct LayoutItem {
  std::string name;  ///< without spaces
  float x, y, width, height;
};

using Layout = std::vector<LayoutItem>;

/// Records the rectangle of the widget that ImGui drew last.
void Note(Layout& layout, const std::string& name);

}  // namespace crownfit
