#pragma once

#include <optional>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Where a layer's mesh lies on that of a layer above, or within rounding of it, as meshes of a segmented tooth do that
/// share their root, no ray can tell which comes first. Moves the inner mesh a hair outwards there, so that the
/// innermost layer wins as everywhere. `names`: the layers'. What was moved is added to `messages`.
void SeparateTouchingLayers(std::vector<std::optional<TriangleMesh>>& meshes, const std::vector<std::string>& names,
                            int threads, std::vector<std::string>& messages);

}  // namespace crownfit
