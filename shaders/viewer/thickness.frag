// False colours of a thickness; they go to the screen as they are.

in float thickness_mm;

uniform float most_mm;
uniform vec3 colours[6];  // evenly from 0 to most_mm

out vec4 pixel;

void main() {
  float at = 5.0 * clamp(thickness_mm / most_mm, 0.0, 1.0);
  int step = min(int(at), 4);
  pixel = vec4(mix(colours[step], colours[step + 1], at - float(step)), 1.0);
}
