// Light that enters the diffusing layer below each vertex: ShaderPrediction's constructor.

out vec4 entering;

void main() {
  Column column = ColumnOf(gl_VertexID);
  vec3 extinction = OuterExtinction(column.absorption_factor), sum = vec3(0.0);
  int end = texelFetch(first_share, gl_VertexID + 1).r;
  for (int s = texelFetch(first_share, gl_VertexID).r; s < end; ++s) {
    Share share = ShareOf(s);
    vec3 passed = vec3(1.0 - SurfaceReflectance(share.cos_incidence));
    if (has_outer) passed *= ThroughOuter(extinction, Now(share.path));
    sum += share.irradiance * passed;
  }
  entering = vec4(sum, 0.0);
}
