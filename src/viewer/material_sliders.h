#pragma once
// Converts between a material and the window's sliders.

#include "optics/material_file.h"
#include "viewer/panel.h"

namespace crownfit {

/// Sliders for every parameter with a value in the material, with the data of its file.
std::vector<SliderGroup> SlidersOf(const Capture& capture, const MaterialRecord& record);

/// `material` with the sliders' values.
Material MaterialOf(const std::vector<SliderGroup>& groups, Material material);

}  // namespace crownfit
