// The photograph's camera (src/capture/camera.h), set by SetCamera.

uniform mat3 camera_rotation;
uniform vec3 camera_translation, focal_centre_x, focal_centre_y;  // (f, c, size) in pixels
uniform float distortion[8];                                      // k1 k2 p1 p2 k3 k4 k5 k6 (OpenCV)
uniform vec2 depth_range;

vec4 Projected(vec3 position) {
  vec3 p = camera_rotation * position + camera_translation;
  vec2 q = p.xy / p.z;
  float r2 = dot(q, q), radial = (1.0 + r2 * (distortion[0] + r2 * (distortion[1] + r2 * distortion[4]))) /
                                  (1.0 + r2 * (distortion[5] + r2 * (distortion[6] + r2 * distortion[7])));
  q = radial * q + vec2(2.0 * distortion[2] * q.x * q.y + distortion[3] * (r2 + 2.0 * q.x * q.x),
                        distortion[2] * (r2 + 2.0 * q.y * q.y) + 2.0 * distortion[3] * q.x * q.y);
  vec2 pixel = vec2(focal_centre_x.x * q.x + focal_centre_x.y, focal_centre_y.x * q.y + focal_centre_y.y);
  vec2 ndc = vec2(2.0 * pixel.x / focal_centre_x.z - 1.0, 1.0 - 2.0 * pixel.y / focal_centre_y.z);
  float depth = (depth_range.y + depth_range.x - 2.0 * depth_range.x * depth_range.y / p.z) / (depth_range.y - depth_range.x);
  return vec4(ndc * p.z, depth * p.z, p.z);
}
