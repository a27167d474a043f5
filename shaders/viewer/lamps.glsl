// Lamps reflected by the surface (src/viewer/lamps.h).

uniform int lamps, first_point[9], first_environment[8];
uniform int every;  // takes every n-th point of a lamp
layout(std140) uniform LampPoints {
  vec4 lamp_points[864];  // 3 per point: position; normal, 1 for far ones; radiance x area (x solid angle for far ones)
};
uniform samplerBuffer reflected_skies;  // of a uniform sky, over the view's cosine: by roughness, by the film's mirror
uniform int sky_nodes;
uniform vec3 sky[8];                    // radiance of domes, by lamp
uniform samplerBuffer environments;     // per map 64 x 32 directions blurred by the surface, then 256 x 128 sharp ones
uniform samplerBuffer mirrors;          // 6 per lamp

// What one small area of a lamp adds.
vec3 OfPoint(int i, vec3 place, vec3 normal, vec3 view, float cos_view) {
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

vec3 InTable(int first, int width, int height, vec3 direction) {
  float x = float(width) * atan(direction.x, direction.z) / (2.0 * TERM_PI) - 0.5,
        y = float(height) * acos(clamp(direction.y, -1.0, 1.0)) / TERM_PI - 0.5;
  int left = int(floor(x)), above = int(floor(y));
  vec3 rows[2];
  for (int k = 0; k < 2; ++k) {
    int row = first + width * clamp(above + k, 0, height - 1);
    rows[k] = mix(texelFetch(environments, row + (left + width) % width).rgb,
                  texelFetch(environments, row + (left + 1 + width) % width).rgb, x - float(left));
  }
  return mix(rows[0], rows[1], y - float(above));
}

// Light from all around.
vec3 OfSky(int lamp, vec3 mirrored, float cos_view) {
  float u = cos_view * float(sky_nodes - 1);
  int node = min(int(u), sky_nodes - 2);
  vec2 share = mix(texelFetch(reflected_skies, node).rg, texelFetch(reflected_skies, node + 1).rg, u - float(node));
  int first = first_environment[lamp];
  if (first < 0) return (share.x + share.y) * sky[lamp];
  vec3 sum = share.x * InTable(first, 64, 32, mirrored);
  if (share.y > 0.0) sum += share.y * InTable(first + 64 * 32, 256, 128, mirrored);
  return sum;
}

#ifdef WET
// Radiance of a small lamp along a ray (geometry/light_samples.h: LightAlong).
vec3 LampAlong(int lamp, vec3 from, vec3 direction) {
  vec4 kind = texelFetch(mirrors, 6 * lamp);
  vec3 at = texelFetch(mirrors, 6 * lamp + 1).xyz, normal = texelFetch(mirrors, 6 * lamp + 2).xyz,
       radiance = texelFetch(mirrors, 6 * lamp + 5).rgb;
  if (kind.x == 0.0) return vec3(0.0);
  if (kind.x == 3.0) return dot(direction, at) >= kind.y ? radiance : vec3(0.0);
  if (kind.x == 4.0) {
    vec3 way = at - from;
    float sine2 = clamp(kind.y * kind.y / dot(way, way), 1e-8, 1.0), cosine = dot(direction, normalize(way));
    return cosine > 0.0 && 1.0 - cosine * cosine <= sine2 ? radiance / (dot(way, way) * sine2) : vec3(0.0);
  }
  float cosine = -dot(direction, normal), distance = dot(from - at, normal) / cosine;
  if (cosine <= 0.0 || distance <= 0.0) return vec3(0.0);
  vec3 met = from + distance * direction - at;
  bool is_met = kind.x == 1.0 ? dot(met, met) >= kind.y && dot(met, met) <= kind.z
                              : abs(dot(met, texelFetch(mirrors, 6 * lamp + 3).xyz)) <= 1.0 &&
                                    abs(dot(met, texelFetch(mirrors, 6 * lamp + 4).xyz)) <= 1.0;
  return is_met ? radiance : vec3(0.0);
}

// The mean over the pixel.
vec3 MirroredLamp(int lamp, vec3 place, vec3 mirrored) {
  vec3 right = dFdx(mirrored), down = dFdy(mirrored), sum = vec3(0.0);
  for (int quarter = 0; quarter < 4; ++quarter) {
    vec2 offset = vec2(quarter & 1, quarter >> 1) * 0.5 - 0.25;
    sum += 0.25 * LampAlong(lamp, place, normalize(mirrored + offset.x * right + offset.y * down));
  }
  return sum;
}
#endif

vec3 Gloss(vec3 place, vec3 normal, vec3 view, float cos_view, float visible[8]) {
  vec3 sum = vec3(0.0), mirrored = reflect(-view, normal);
  for (int lamp = 0; lamp < lamps; ++lamp) {
#ifdef WET
    vec3 of_film = wetness * FresnelReflectance(cos_view, film_ior) * MirroredLamp(lamp, place, mirrored);
#else
    vec3 of_film = vec3(0.0);
#endif
    if (visible[lamp] <= 0.0) continue;
    vec3 of_lamp = vec3(0.0);
    for (int i = first_point[lamp]; i < first_point[lamp + 1]; i += every)
      of_lamp += OfPoint(i, place, normal, view, cos_view);
    sum += light_scale[lamp] * visible[lamp] * (float(every) * of_lamp + OfSky(lamp, mirrored, cos_view) + of_film);
  }
  return sum;
}
