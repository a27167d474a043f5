// Light that leaves the layers at each vertex: entering light blurred by their profile, on this side and through from the
// other (ShaderPrediction::Leaving).

uniform samplerBuffer entering;
uniform isamplerBuffer taps;         // 2 per tap: front's vertices, ring (and 256 where the tap lies below the neck); opposite's, exists
uniform samplerBuffer tap_weights;   // 2 per tap
uniform isamplerBuffer first_tap;
uniform float share_of_ring[16];     // 1 / taps in the ring

out vec4 exitance;

vec3 EnteringAt(ivec3 vertices, vec3 weights) {
  return weights.x * texelFetch(entering, vertices.x).rgb + weights.y * texelFetch(entering, vertices.y).rgb +
         weights.z * texelFetch(entering, vertices.z).rgb;
}

void main() {
  Column column = ColumnOf(gl_VertexID);
  Place place = PlaceOf(column), through = PlaceThrough(column);
  vec3 sum = vec3(0.0), reflected = vec3(0.0), transmitted = vec3(0.0);
  int end = texelFetch(first_tap, gl_VertexID + 1).r, ring = -1;
  for (int t = texelFetch(first_tap, gl_VertexID).r; t < end; ++t) {
    ivec4 front = texelFetch(taps, 2 * t), opposite = texelFetch(taps, 2 * t + 1);
    if ((front.w & 255) != ring) {  // taps come ring by ring
      ring = front.w & 255;
      reflected = share_of_ring[ring] * ReflectedRing(place, ring);
      transmitted = share_of_ring[ring] * TransmittedRing(through, ring);
    }
    vec3 seen = reflected * EnteringAt(front.xyz, texelFetch(tap_weights, 2 * t).xyz);
    if (opposite.w != 0) seen += transmitted * EnteringAt(opposite.xyz, texelFetch(tap_weights, 2 * t + 1).xyz);
    sum += front.w >= 256 ? neck_return * seen : seen;
  }
  exitance = vec4(ThroughTexture(column) * sum, 0.0);
}
