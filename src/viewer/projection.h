#pragma once
// The camera of shaders/viewer/camera.glsl.

#include "capture/capture.h"
#include "geometry/triangle_mesh.h"
#include "viewer/gl.h"

namespace crownfit {

/// Sets the camera's uniforms; depth spans a box around what is drawn.
void SetCamera(Program& program, const PhotographSpec& photo, const std::pair<glm::dvec3, glm::dvec3>& bounds);

}  // namespace crownfit
