#pragma once
// What repairs of meshes share: edges with the faces beside them, an order of vertices, areas.

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>
#include <unordered_map>
#include <vector>

#include "geometry/edge_key.h"
#include "geometry/triangle_mesh.h"

namespace crownfit {

struct DirectedEdges {
  std::vector<int> forward, backward;  ///< triangles that run through the edge from low to high index, and back
  size_t count() const { return forward.size() + backward.size(); }
};
std::unordered_map<uint64_t, DirectedEdges> EdgesOf(const TriangleMesh& mesh);

/// Edges at which an odd number of faces meet.
size_t OpenEdges(const TriangleMesh& mesh);

double AreaOf(const TriangleMesh& mesh, const glm::ivec3& triangle);  ///< mm2

/// Every vertex's place in the order of positions, so that a repair does not depend on the order in the file.
std::vector<int> RanksByPosition(const TriangleMesh& mesh);

/// Takes out the vertices of no triangle; returns how many there were. They would count where vertices stand for the
/// surface.
size_t DropLooseVertices(TriangleMesh& mesh);

// mesh_weld.cpp

/// Closes seams: welds equal positions (STL shares none, texture seams double them), then, where edges are still open,
/// positions that rounding has moved apart. Takes out triangles that collapsed, here or before; returns how many.
size_t WeldSeams(TriangleMesh& mesh, double rounding_mm, const std::string& name, std::vector<std::string>& messages);

/// Takes out faces between corners that another has already, whichever way round (exports with both sides): their
/// surface would be crossed twice. Where two bodies touch in such faces, both go: without the wall the bodies are one.
void DropRepeatedFaces(TriangleMesh& mesh, const std::string& name, std::vector<std::string>& messages);

// mesh_cracks.cpp

/// Closes cracks without width: splits open edges at corners that lie on them (T-vertices). Corners keep their places.
void SplitAtCorners(TriangleMesh& mesh, double rounding_mm, const std::string& name,
                    std::vector<std::string>& messages);

// mesh_shells.cpp

/// Turns faces until neighbours across plain edges agree, and so that a part of the surface which ends somewhere looks
/// away from its middle. Throws InputError where neighbours can't agree.
void AgreeOnOrientation(const std::filesystem::path& file, TriangleMesh& mesh);

/// Turns every body of a closed surface outwards, and a cavity, which lies inside an odd number of others, inwards.
void TurnShells(TriangleMesh& mesh);

/// Says what turning changed against the file, where `before` are the faces that it had.
void SayWhatTurned(const TriangleMesh& mesh, const std::vector<glm::ivec3>& before, const std::string& name,
                   std::vector<std::string>& messages);

}  // namespace crownfit
