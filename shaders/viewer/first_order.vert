// First-order scattering in the outer layer towards the camera, at each vertex (ShaderPrediction::FirstOrder).

uniform samplerBuffer frames;  // 2 per vertex: position, normal
uniform vec3 camera_position;

out vec4 first_order;

void main() {
  vec3 sum = vec3(0.0);
  if (has_outer) {
    Column column = ColumnOf(gl_VertexID);
    vec3 position = texelFetch(frames, 2 * gl_VertexID).xyz, normal = texelFetch(frames, 2 * gl_VertexID + 1).xyz;
    float cos_view = max(dot(normal, normalize(camera_position - position)), 1e-3);
    vec3 extinction = OuterExtinction(column.absorption_factor), albedo = outer_scattering / max(extinction, vec3(1e-9)),
         tau = extinction * Now(column.front);
    float mu = RefractedCosine(cos_view, entry_ior), leaving = 1.0 - SurfaceReflectance(cos_view), phase = 0.25 / TERM_PI;
    int end = texelFetch(first_share, gl_VertexID + 1).r;
    for (int s = texelFetch(first_share, gl_VertexID).r; s < end; ++s) {
      Share share = ShareOf(s);
      float mu0 = RefractedCosine(share.cos_incidence, entry_ior),
            passed = leaving * (1.0 - SurfaceReflectance(share.cos_incidence));
      for (int c = 0; c < 3; ++c)
        sum[c] += share.irradiance[c] * SingleScatterReflection(albedo[c], phase, passed, entry_ior, tau[c], mu0, mu);
    }
  }
  first_order = vec4(sum, 0.0);
}
