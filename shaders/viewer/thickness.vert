layout(location = 0) in vec3 position;
layout(location = 1) in vec2 front;  // thickness: x stays, y scales with the layer's

uniform float thickness_scale;

out float thickness_mm;

void main() {
  thickness_mm = front.x + front.y * thickness_scale;
  gl_Position = Projected(position);
}
