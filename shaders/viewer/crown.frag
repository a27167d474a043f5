// One pixel: diffuse light, first order, surface reflection (ShaderPrediction::Pixel).

in vec3 place, shading_normal, leaving, scattered;
in vec4 lamp_visibility, more_visibility;

uniform vec3 camera_position;
uniform float first_factor, specular_factor;  // by the polarisers
uniform bool show_diffuse, show_first, show_gloss;

out vec4 pixel;

void main() {
  vec3 normal = normalize(shading_normal), view = normalize(camera_position - place);
  float cos_view = max(dot(normal, view), 1e-3);
  vec3 diffuse = leaving * ExitLobe(SurfaceReflectance(cos_view), diffuse_fresnel);
  vec3 sum = vec3(0.0);
  if (show_diffuse) sum += diffuse;
  if (show_first) sum += first_factor * scattered;
  if (show_gloss && specular_factor > 0.0) {
    float visible[8] = float[8](lamp_visibility.x, lamp_visibility.y, lamp_visibility.z, lamp_visibility.w,
                                more_visibility.x, more_visibility.y, more_visibility.z, more_visibility.w);
    sum += specular_factor * Gloss(place, normal, view, cos_view, visible);
  }
  pixel = vec4(TERM_PI * sum, 1.0);
}
