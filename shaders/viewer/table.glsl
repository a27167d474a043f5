// The layers' shares per ring, tabulated over the thicknesses of the outer and the inner one (DiffuserTable in
// src/shader/diffuser_table.h).

uniform samplerBuffer table;  // inner nodes of each outer node: reflected rings, transmitted rings, totals of both, way in the outer layer
uniform int rings, outer_nodes, inner_nodes;

struct Place {
  int first, rows;
  vec4 outer, inner;
};

// The first of four nodes around a place, and their weights; beyond the ends values go on straight.
int Around(float place, int nodes, out vec4 weight) {
  float u = clamp(place, 0.0, float(nodes - 1));
  int node = clamp(int(u), 0, nodes - 2);
  float f = u - float(node), before = CubicWeight(-1, f), at = CubicWeight(0, f), next = CubicWeight(1, f), after = CubicWeight(2, f);
  if (node == 0) {
    weight = vec4(at + 2.0 * before, next - before, after, 0.0);
    return 0;
  }
  if (node == nodes - 2) {
    weight = vec4(0.0, before, at - after, next + 2.0 * after);
    return node - 2;
  }
  weight = vec4(before, at, next, after);
  return node - 1;
}

Place PlaceAt(float outer_mm, float inner_mm) {
  Place p;
  p.rows = 1;
  p.outer = vec4(1.0, 0.0, 0.0, 0.0);
  p.first = Around(TablePlace(inner_mm), inner_nodes, p.inner);
  if (outer_nodes > 1) {
    p.rows = 4;
    p.first += inner_nodes * Around(0.5 * TablePlace(outer_mm), outer_nodes, p.outer);
  }
  return p;
}

vec3 FromTable(Place p, int column) {
  int width = 2 * rings + 3;
  vec3 sum = vec3(0.0);
  for (int r = 0; r < p.rows; ++r) {
    vec3 row = vec3(0.0);
    for (int k = 0; k < 4; ++k) row += p.inner[k] * texelFetch(table, (p.first + r * inner_nodes + k) * width + column).rgb;
    sum += p.outer[r] * row;
  }
  return sum;
}
vec3 ReflectedRing(Place p, int ring) { return FromTable(p, ring); }
vec3 TransmittedRing(Place p, int ring) { return FromTable(p, rings + ring); }
vec3 TotalReflected(Place p) { return FromTable(p, 2 * rings); }

Place PlaceOf(Column c) { return PlaceAt(Now(c.front), InnerThickness(c.front, c.back, c.total_mm)); }
Place PlaceThrough(Column c) {
  return PlaceAt(0.5 * (Now(c.front) + Now(c.back)), InnerThickness(c.front, c.back, c.total_mm));
}

// What of the light that enters or leaves here the texture of the outer layer leaves for it.
vec3 ThroughTexture(Column c) {
  if (!has_outer || c.absorption_factor == vec3(1.0)) return vec3(1.0);
  vec3 way = FromTable(PlaceOf(c), 2 * rings + 2), more = (c.absorption_factor - 1.0) * outer_absorption;
  return vec3(Attenuation(more.r, way.r), Attenuation(more.g, way.g), Attenuation(more.b, way.b));
}
