#pragma once
// Ray casts of one photograph: what the shader model needs for every vertex and pixel.

#include <vector>

#include "scene/cast_samples.h"

namespace crownfit {

struct Capture;

/// Meshes of the capture's scenery, in the order of Capture::scenery.
std::vector<TriangleMesh> ReadScenery(const Capture& capture);

/// Casts only the light that arrives at the vertices.
VertexCast CastVertices(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                        size_t photograph, const CastOptions& options);

/// Casts one photograph: every pixel that shows the object, and scenery when options say so.
PhotographCast CastPhotograph(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                              size_t photograph, const CastOptions& options);

/// Casts only the `wanted` pixels (row by row), in light that was cast already.
PhotographCast CastPixels(const Capture& capture, const Crown& crown, const std::vector<TriangleMesh>& scenery,
                          size_t photograph, const CastOptions& options, const VertexCast& light,
                          const std::vector<uint8_t>& wanted);

}  // namespace crownfit
