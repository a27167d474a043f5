// One corner of a triangle of the crown.

layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;  // shading normal of this corner: smooth on a curve, sharp at a rim
layout(location = 2) in int vertex;

uniform samplerBuffer exitance, first_order, visibility;

out vec3 place, shading_normal, leaving, scattered;
out vec4 lamp_visibility, more_visibility;

void main() {
  place = position;
  shading_normal = normal;
  leaving = texelFetch(exitance, vertex).rgb;
  scattered = texelFetch(first_order, vertex).rgb;
  lamp_visibility = texelFetch(visibility, 2 * vertex);
  more_visibility = texelFetch(visibility, 2 * vertex + 1);
  gl_Position = Projected(position);
}
