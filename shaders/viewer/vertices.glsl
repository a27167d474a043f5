// What was cast at the vertices of the crown (src/viewer/crown_renderer.cpp packs it).

uniform samplerBuffer columns;  // 2 per vertex: front and back (fixed, scaled); total, absorption factor
uniform samplerBuffer shares;   // irradiance, cosine
uniform isamplerBuffer share_light, first_share;

struct Column {
  vec2 front, back;
  float total_mm;
  vec3 absorption_factor;
};

Column ColumnOf(int vertex) {
  vec4 lengths = texelFetch(columns, 2 * vertex), rest = texelFetch(columns, 2 * vertex + 1);
  return Column(lengths.xy, lengths.zw, rest.x, rest.yzw);
}

struct Share {
  vec3 irradiance;
  float cos_incidence;
};

Share ShareOf(int index) {
  vec4 light = texelFetch(shares, index);
  return Share(light_scale[texelFetch(share_light, index).r] * light.rgb, light.a);
}
