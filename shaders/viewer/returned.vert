// Adds light that a tile behind the object returns: ShaderPrediction::AddLightReturnedByBacking.

uniform samplerBuffer direct, leaving;  // entering light without the tile, and what leaves of it
uniform samplerBuffer backing;          // BackingShare

out vec4 entering;

void main() {
  entering = texelFetch(direct, gl_VertexID);
  vec3 rho = texelFetch(backing, gl_VertexID).rgb;
  if (rho == vec3(0.0)) return;
  entering.rgb += rho * texelFetch(leaving, gl_VertexID).rgb / (1.0 - rho * TotalReflected(PlaceOf(ColumnOf(gl_VertexID))));
}
