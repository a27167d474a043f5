#pragma once
// The camera of shaders/viewer/camera.glsl.

#include "calibration/capture.h"
#include "geometry/triangle_mesh.h"
#include "viewer/gl.h"

namespace crownfit {

/// Sets the camera's uniforms; depth is kept around `mesh`.
void SetCamera(Program& program, const PhotographSpec& photo, const TriangleMesh& mesh);

}  // namespace crownfit
