// Adds light that a tile behind the object returns: ShaderPrediction::AddLightReturnedByBacking.

uniform samplerBuffer direct;   // entering light without the tile
uniform samplerBuffer backing;  // tile's reflectance times its share of the sky

out vec4 entering;

void main() {
  entering = texelFetch(direct, gl_VertexID);
  vec3 rho = texelFetch(backing, gl_VertexID).rgb;
  ivec4 opposite = texelFetch(opposites, gl_VertexID);
  if (opposite.w == 0 || rho == vec3(0.0)) return;
  vec3 weights = texelFetch(columns, 3 * gl_VertexID + 2).xyz, from_front = vec3(0.0);
  for (int k = 0; k < 3; ++k) from_front += weights[k] * texelFetch(direct, opposite[k]).rgb;
  Column column = ColumnOf(gl_VertexID);
  Place place = PlaceOf(DiffuserThickness(column.front, column.back, column.total_mm));
  vec3 came = TotalTransmitted(place) * from_front;
  if (has_outer) {
    vec3 once = ThroughOuter(OuterExtinction(column.absorption_factor), Now(column.front));
    came *= once * once;
  }
  entering.rgb += came * rho / (1.0 - rho * TotalReflected(place));
}
