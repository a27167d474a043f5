#pragma once
// Builds a crown from its layers, ready for ray casts.

#include <memory>
#include <vector>

#include "scene/crown.h"
#include "scene/crown_source.h"

namespace crownfit {

/// How finely the shader model resolves a crown.
struct CrownDetail {
  TapKernel kernel = ConvergedKernel();  ///< of its blur
  size_t fine_triangles = 60000;         ///< to which the mesh is refined for Crown::fine ...
  bool simplifies = false;               ///< ... or simplified, if it has more
};

/// The longest edge of a surface refined to about so many triangles: 0.2 mm where fewer suffice.
double FineEdge_mm(const TriangleMesh& surface, size_t triangles);

/// The nested surfaces of BuildSurfaces, with everything on which the shader model casts.
std::shared_ptr<const Crown> BuildCrown(const Capture& capture, const CrownSource& source,
                                        const std::vector<double>& thickness, int threads,
                                        const CrownDetail& detail = {});

}  // namespace crownfit
