#pragma once
// Strict readers for PLY, STL and OBJ: libraries drop vertex properties, merge NaN vertices or accept truncated files.

#include <filesystem>
#include <string>
#include <vector>

#include "geometry/triangle_mesh.h"

namespace crownfit {

/// Reads the triangles as they stand (polygons become triangles).
/// Throws InputError: missing, truncated, not finite, index out of range, no triangles.
TriangleMesh ReadMeshFile(const std::filesystem::path& file);

/// Binary little-endian PLY. Vertex properties are written as doubles.
void WritePly(const std::filesystem::path& file, const TriangleMesh& mesh);

/// Reads a closed surface in millimetres. Welds duplicate vertices, splits edges at corners that lie on them, orients
/// all faces outwards and closes every opening by a fan from the middle of its rim. Marks the largest opening of more
/// than 1 mm2 as the cut at the neck. Repairs are added to `messages`. Refuses what can't be repaired (openings of more
/// than half the surface's area, a size that is not that of a crown).
TriangleMesh ReadClosedSurface(const std::filesystem::path& file, std::vector<std::string>& messages);

}  // namespace crownfit
