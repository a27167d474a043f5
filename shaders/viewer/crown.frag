// One pixel: diffuse light, first order, surface reflection (ShaderPrediction::Pixel).

in vec3 place, shading_normal, leaving, scattered;
in vec4 lamp_visibility, more_visibility;

uniform vec3 camera_position;
uniform float specular_factor;      // by the polarisers
uniform int lamps, first_point[9];
uniform int every;  // takes every n-th point of a lamp
layout(std140) uniform LampPoints {
  vec4 lamp_points[864];  // 3 per point: position; normal, 1 for far ones; radiance x area (x solid angle for far ones)
};
uniform samplerBuffer gloss_table;  // reflection of a uniform sky by the rough surface, over the view's cosine
uniform int gloss_nodes;
uniform vec3 sky[8];                // radiance of the lamps that are all around, by number
uniform bool show_diffuse, show_first, show_gloss;

out vec4 pixel;

// What one small area of a lamp adds.
vec3 Mirrored(int i, vec3 normal, vec3 view, float cos_view) {
  vec4 point = lamp_points[3 * i], facing = lamp_points[3 * i + 1];
  bool is_far = facing.w != 0.0;
  vec3 way = is_far ? point.xyz : point.xyz - place;
  float per_square = is_far ? 1.0 : 1.0 / dot(way, way);
  vec3 light = way * sqrt(per_square);
  float cos_light = dot(light, normal), shines = is_far ? 1.0 : -dot(light, facing.xyz) * per_square;
  if (cos_light <= 0.0 || shines <= 0.0) return vec3(0.0);
  vec3 half_way = normalize(light + view);
  float cos_half = dot(half_way, normal), cos_light_half = dot(light, half_way);
  float reflected = SurfaceReflection(cos_light, cos_view, cos_half, cos_light_half, roughness, entry_ior);
#ifdef WET
  float wet = SurfaceReflectionUnderFilm(cos_light, cos_view, cos_half, cos_light_half, roughness, entry_ior, film_ior);
  reflected += wetness * (wet - reflected);
#endif
  return reflected * cos_light * shines * lamp_points[3 * i + 2].rgb;
}

vec3 Gloss(vec3 normal, vec3 view, float cos_view) {
  float u = cos_view * float(gloss_nodes - 1);
  int node = min(int(u), gloss_nodes - 2);
  float around = mix(texelFetch(gloss_table, node).r, texelFetch(gloss_table, node + 1).r, u - float(node));
  float visible[8] = float[8](lamp_visibility.x, lamp_visibility.y, lamp_visibility.z, lamp_visibility.w,
                              more_visibility.x, more_visibility.y, more_visibility.z, more_visibility.w);
  vec3 sum = vec3(0.0);
  for (int lamp = 0; lamp < lamps; ++lamp) {
    if (visible[lamp] <= 0.0) continue;
    vec3 of_lamp = vec3(0.0);
    for (int i = first_point[lamp]; i < first_point[lamp + 1]; i += every) of_lamp += Mirrored(i, normal, view, cos_view);
    sum += light_scale[lamp] * visible[lamp] * (float(every) * of_lamp + around * sky[lamp]);
  }
  return sum;
}

void main() {
  vec3 normal = normalize(shading_normal), view = normalize(camera_position - place);
  float cos_view = max(dot(normal, view), 1e-3);
  vec3 diffuse = leaving * ExitLobe(SurfaceReflectance(cos_view), diffuse_fresnel);
  vec3 sum = vec3(0.0);
  if (show_diffuse) sum += diffuse;
  if (show_first) sum += scattered;
  if (show_gloss && specular_factor > 0.0) sum += specular_factor * Gloss(normal, view, cos_view);
  pixel = vec4(TERM_PI * sum, 1.0);
}
