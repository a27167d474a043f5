#pragma once
// Triangulation of a mesh file's polygons.

#include <array>
#include <glm/glm.hpp>
#include <optional>
#include <vector>

namespace crownfit {

/// Triangles of a polygon by its corners' numbers, by ear clipping (Meisters 1975) in the plane of its Newell normal.
/// Of all ears the one with the shortest new edge is cut first, so that a warped polygon's surface does not depend on
/// its first corner; of these, ears that leave no sliver at a corner on a straight edge go first. Corners repeated in a
/// row give triangles without area. Nothing where the polygon crosses itself or has no area.
std::optional<std::vector<std::array<int, 3>>> Triangulated(const std::vector<glm::dvec3>& corners);

}  // namespace crownfit
