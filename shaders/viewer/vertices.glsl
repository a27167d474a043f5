// What was cast at the vertices of the crown (src/viewer/crown_buffers.h packs it).

uniform samplerBuffer columns;    // 3 per vertex: front and back (fixed, scaled); total, absorption factor; opposite's weights
uniform isamplerBuffer opposites; // opposite's vertices, and whether it exists
uniform samplerBuffer shares;     // 2 per share: irradiance, cosine; path (fixed, scaled), light
uniform isamplerBuffer first_share;

struct Column {
  vec2 front, back;
  float total_mm;
  vec3 absorption_factor;
};

Column ColumnOf(int vertex) {
  vec4 lengths = texelFetch(columns, 3 * vertex), rest = texelFetch(columns, 3 * vertex + 1);
  return Column(lengths.xy, lengths.zw, rest.x, rest.yzw);
}

struct Share {
  vec3 irradiance;
  float cos_incidence;
  vec2 path;
};

Share ShareOf(int index) {
  vec4 light = texelFetch(shares, 2 * index), path = texelFetch(shares, 2 * index + 1);
  return Share(light_scale[int(path.z)] * light.rgb, light.a, path.xy);
}
