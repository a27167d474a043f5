#pragma once
// Sections through a crown.

#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"
#include "photo/image.h"

namespace crownfit {

/// Three slices through the middle of the object, along its coordinate planes, every layer in its colour (the innermost
/// that holds a point, as in the models), with a scale bar and the layers' names. sRGB in [0, 1].
Image SectionFigure(const std::vector<TriangleMesh>& surfaces, const std::vector<std::string>& names, int threads);

}  // namespace crownfit
