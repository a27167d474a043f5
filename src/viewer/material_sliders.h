#pragma once
// A material as the window's sliders, and back.

#include "optics/material_file.h"
#include "viewer/panel.h"

namespace crownfit {

/// Every parameter that the material has a value of, with what its file says of it.
std::vector<SliderGroup> SlidersOf(const Capture& capture, const MaterialRecord& record);

/// `material` with the sliders' values.
Material MaterialOf(const std::vector<SliderGroup>& groups, Material material);

}  // namespace crownfit
