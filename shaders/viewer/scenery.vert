// Scenery and tile, shaded at their vertices (geometry/cast_samples.h: ShadedMesh).

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 front;
layout(location = 2) in vec4 back;  // w = 0: has none

out vec3 in_front;
out vec4 behind;

void main() {
  in_front = front;
  behind = back;
  gl_Position = Projected(position);
}
