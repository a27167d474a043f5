#pragma once
// Closed meshes of known shape.

#include "geometry/triangle_mesh.h"

namespace crownfit {

TriangleMesh Sphere(double radius_mm, int rings = 48);

/// The part of a mesh above z = `above`, with lower vertices raised to that plane: an open scan with a flat rim.
TriangleMesh OpenBelow(const TriangleMesh& mesh, double above);

/// Flat disc, faces at z = 0 and z = -thickness, with an inner ring so that its faces are no needles.
TriangleMesh Disc(double thickness_mm, double radius_mm, int sides = 64);

/// Axis-aligned box.
TriangleMesh Box(const glm::dvec3& low, const glm::dvec3& high);

/// Axis-aligned box of faces with vertices of their own, grids of `cells` squares along every edge; that at high z has
/// `top_cells`.
TriangleMesh GridBox(const glm::dvec3& low, const glm::dvec3& high, int cells, int top_cells);

/// A thick-walled open vessel: a body with a hollow, so that light leaves it and enters it again.
TriangleMesh Cup(double radius_mm, double height_mm, double wall_mm, int sides = 64);

/// An upper incisor's crown, about 8.4 x 10 x 6 mm: axis along y with the edge at +y, the facial side looks along +z.
/// Superelliptic cross-sections that flatten towards the edge: `levels` of 4/3 as many corners.
TriangleMesh Incisor(int levels = 72);

}  // namespace crownfit
