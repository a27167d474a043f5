// Light that enters the layers at each vertex: ShaderPrediction's constructor.

out vec4 entering;

void main() {
  vec3 sum = vec3(0.0);
  int end = texelFetch(first_share, gl_VertexID + 1).r;
  for (int s = texelFetch(first_share, gl_VertexID).r; s < end; ++s) {
    Share share = ShareOf(s);
    sum += (1.0 - SurfaceReflectance(share.cos_incidence)) * share.irradiance;
  }
  entering = vec4(ThroughTexture(ColumnOf(gl_VertexID)) * sum, 0.0);
}
