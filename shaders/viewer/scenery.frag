in vec3 in_front;
in vec4 behind;

out vec4 pixel;

void main() {
  if (!gl_FrontFacing && behind.w == 0.0) discard;
  pixel = vec4(gl_FrontFacing ? in_front : behind.rgb, 1.0);
}
