#include "path/flight_lanes.h"

#include <cmath>

#include "path/lane_math.h"
#include "path/vector_clones.h"

namespace crownfit {

CROWNFIT_FOR_EVERY_VECTOR
void FlightLanes::Fly(const TriangleGrid& facets, int count) {
  const TriangleGrid::Distances grid = facets.distances();
  alignas(64) Lanes<double> nx, ny, nz, here_off, there_off, mx, my, mz, is_free;
  alignas(64) Lanes<int> here, there;
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    uint64_t state = random[i];
    const double flight = -Log(1.0 - NextUniform(state, random_step[i])) * free_path_mm[i];
    random[i] = state;
    flight_mm[i] = flight;
    nx[i] = x[i] + flight * dx[i];
    ny[i] = y[i] + flight * dy[i];
    nz[i] = z[i] + flight * dz[i];
  }
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const TriangleGrid::Distances::Place from = grid.Find(x[i], y[i], z[i]), to = grid.Find(nx[i], ny[i], nz[i]);
    here[i] = from.cube;
    there[i] = to.cube;
    here_off[i] = from.off_mm;
    mx[i] = from.middle_x, my[i] = from.middle_y, mz[i] = from.middle_z;
    there_off[i] = to.off_mm;
  }
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    // The flight is free if the distances to surfaces from both ends add up to more than its length.
    const double from_here = static_cast<double>(grid.distance_mm[here[i]]) - here_off[i],
                 from_there = static_cast<double>(grid.distance_mm[there[i]]) - there_off[i];
    const double clear = (from_here > 0.0 ? from_here : 0.0) + (from_there > 0.0 ? from_there : 0.0);
    is_free[i] = flight_mm[i] < clear ? 1.0 : 0.0;
    here[i] = flight_mm[i] < clear ? 0 : here[i];  // only the other flights read their slab
  }
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    // It is also free if it stays in the ball and on one side of the slab that holds the surfaces.
    const int slab = 8 * here[i];
    const double s_nx = grid.slab[slab], s_ny = grid.slab[slab + 1], s_nz = grid.slab[slab + 2],
                 low = grid.slab[slab + 3], high = grid.slab[slab + 4];
    const double ax = x[i] - mx[i], ay = y[i] - my[i], az = z[i] - mz[i];
    const double bx = nx[i] - mx[i], by = ny[i] - my[i], bz = nz[i] - mz[i];
    const double at_a = s_nx * ax + s_ny * ay + s_nz * az, at_b = s_nx * bx + s_ny * by + s_nz * bz;
    const double upper = at_a > at_b ? at_a : at_b, lower = at_a > at_b ? at_b : at_a;
    const double below = low - upper, above = lower - high, beside = below > above ? below : above;
    const double passes = beside > 0.0 ? 1.0 : 0.0;
    const double a2 = ax * ax + ay * ay + az * az, b2 = bx * bx + by * by + bz * bz, farther = a2 > b2 ? a2 : b2;
    const double near = farther < grid.reach2_mm2 ? passes : 0.0;
    const double either = is_free[i] > 0.0 ? 1.0 : near;
    const double goes = needs_search[i] == 0.0 ? either : 0.0;
    x[i] = goes > 0.0 ? nx[i] : x[i];
    y[i] = goes > 0.0 ? ny[i] : y[i];
    z[i] = goes > 0.0 ? nz[i] : z[i];
    length_mm[i] += goes > 0.0 ? flight_mm[i] : 0.0;
    collides[i] = goes;
  }
}

CROWNFIT_FOR_EVERY_VECTOR
void FlightLanes::Scatter(int count) {
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const bool collided = collides[i] != 0.0;
    uint64_t state = random[i];
    const uint64_t step = random_step[i];
    const double u = NextUniform(state, step);
    uint64_t after = state;
    const double mixed = NextUniform(after, step);
    state = isotropic_fraction[i] > 0.0 ? after : state;
    const bool isotropic = isotropic_fraction[i] > 0.0 && mixed < isotropic_fraction[i];
    // Henyey and Greenstein 1941; near g = 0 to first order in g, as SamplePhaseFunction.
    const double gi = g[i], c = 2.0 * u - 1.0;
    const bool is_small = gi < 1e-3 && gi > -1e-3;
    const double safe = is_small ? 0.5 : gi, s = (1.0 - safe * safe) / (1.0 - safe + 2.0 * safe * u);
    const double exact = (1.0 + safe * safe - s * s) / (2.0 * safe);
    double cosine = is_small ? c + 1.5 * gi * (1.0 - c * c) : exact;
    cosine = isotropic ? c : cosine;
    cosine = cosine < -1.0 ? -1.0 : cosine;
    cosine = cosine > 1.0 ? 1.0 : cosine;
    turn_cosine[i] = cosine;
    const double square = 1.0 - cosine * cosine, sine = std::sqrt(square > 0.0 ? square : 0.0);
    const Turn turn = TurnBy(NextUniform(state, step));
    const double a = sine * turn.cosine, b = sine * turn.sine;
    // A frame about the direction (Duff et al. 2017).
    const double sign = std::copysign(1.0, dz[i]), p = -1.0 / (sign + dz[i]), q = dx[i] * dy[i] * p;
    const double ux = 1.0 + sign * dx[i] * dx[i] * p, uy = sign * q, uz = -sign * dx[i];
    const double vx = q, vy = sign + dy[i] * dy[i] * p, vz = -dy[i];
    const double wx = a * ux + b * vx + cosine * dx[i], wy = a * uy + b * vy + cosine * dy[i],
                 wz = a * uz + b * vz + cosine * dz[i];
    const double scale = 1.0 / std::sqrt(wx * wx + wy * wy + wz * wz);
    dx[i] = collided ? wx * scale : dx[i];
    dy[i] = collided ? wy * scale : dy[i];
    dz[i] = collided ? wz * scale : dz[i];
    random[i] = collided ? state : random[i];
    collisions[i] += collided ? 1.0 : 0.0;
    until_roulette[i] -= collided ? 1.0 : 0.0;
  }
}

CROWNFIT_FOR_EVERY_VECTOR
void FlightLanes::ScorePhase(int count) {
#pragma GCC ivdep
  for (int i = 0; i < count; ++i) {
    const double gi = g[i], c = turn_cosine[i], f = isotropic_fraction[i];
    const double square = 1.0 - gi * gi, base = 1.0 + gi * gi - 2.0 * gi * c, ratio = square / (base * std::sqrt(base));
    const double slope = 3.0 * (c - gi) / base - 2.0 * gi / square;  // d ln(Henyey-Greenstein) / d g
    const double score = (1.0 - f) * ratio * slope / (f + (1.0 - f) * ratio);
    phase_score[i] += collides[i] != 0.0 ? score : 0.0;
  }
}

void FlightLanes::Copy(int from, int to) {
  for (auto* lanes : {&x, &y, &z, &dx, &dy, &dz, &free_path_mm, &g, &isotropic_fraction, &needs_search, &flight_mm,
                      &length_mm, &collisions, &until_roulette, &collides, &turn_cosine, &phase_score})
    (*lanes)[to] = (*lanes)[from];
  random[to] = random[from];
  random_step[to] = random_step[from];
}

}  // namespace crownfit
