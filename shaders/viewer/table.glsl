// The diffusing layer's shares per ring, tabulated over thickness (src/optics/diffuser.h, DiffuserTable).

uniform samplerBuffer table;  // node by node: reflected rings, transmitted rings, total reflected, total transmitted
uniform int rings, nodes;

struct Place {
  int first;
  vec4 weight;
};

Place PlaceOf(float thickness_mm) {
  float u = TablePlace(clamp(thickness_mm, 0.0, TableThickness(float(nodes - 3))));
  Place p;
  p.first = clamp(int(u), 0, nodes - 4);
  float f = u - float(p.first);
  p.weight = vec4(CubicWeight(-1, f), CubicWeight(0, f), CubicWeight(1, f), CubicWeight(2, f));
  return p;
}

vec3 FromTable(Place p, int column) {
  int width = 2 * rings + 2;
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) sum += p.weight[k] * texelFetch(table, (p.first + k) * width + column).rgb;
  return sum;
}
vec3 ReflectedRing(Place p, int ring) { return FromTable(p, ring); }
vec3 TransmittedRing(Place p, int ring) { return FromTable(p, rings + ring); }
vec3 TotalReflected(Place p) { return FromTable(p, 2 * rings); }
vec3 TotalTransmitted(Place p) { return FromTable(p, 2 * rings + 1); }
