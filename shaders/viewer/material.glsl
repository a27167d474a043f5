// What every pass of the viewer knows of the material; the formulas are those of src/shader/shader_model.h, three channels
// at a time.

uniform bool has_outer, may_be_wet;
uniform vec3 outer_scattering, outer_absorption;
uniform float outer_thickness_scale, diffuser_thickness_scale;
uniform float entry_ior, film_ior, wetness, roughness, neck_return, diffuse_fresnel;
uniform float light_scale[32];

float SurfaceReflectance(float cosine) {
  return may_be_wet ? WetReflectance(cosine, entry_ior, film_ior, wetness) : FresnelReflectance(cosine, entry_ior);
}

vec3 OuterExtinction(vec3 absorption_factor) { return outer_scattering + absorption_factor * outer_absorption; }

// A length in the outer layer: x stays, y scales with the layer's thickness.
float Now(vec2 length_mm) { return length_mm.x + length_mm.y * outer_thickness_scale; }

float InnerThickness(vec2 front, vec2 back, float total_mm) {
  float between = has_outer ? total_mm - Now(front) - Now(back) : total_mm;
  return max(between, 0.0) * diffuser_thickness_scale;
}
