#include "path/slab_lanes.h"

#include <cmath>

#include "optics/shading_terms.h"
#include "path/lane_math.h"
#include "path/vector_clones.h"

namespace crownfit {

void SlabLanes::Enter(int i, const FlatLayer& layer) {
  top_mm[i] = layer.top_mm;
  bottom_mm[i] = layer.bottom_mm;
  free_path_mm[i] = layer.free_path_mm;
  absorption_per_mm[i] = layer.absorption_per_mm;
  g[i] = layer.g;
  isotropic[i] = layer.isotropic_fraction;
  per_isotropic[i] = layer.isotropic_fraction > 0.0 ? 1.0 / layer.isotropic_fraction : 0.0;
  per_other[i] = layer.isotropic_fraction < 1.0 ? 1.0 / (1.0 - layer.isotropic_fraction) : 0.0;
  ior_above[i] = layer.ior_above;
  ior_below[i] = layer.ior_below;
}

CROWNFIT_FOR_EVERY_VECTOR
void SlabLanes::Fly(int count) {
  constexpr double kLogLive = 1.38629436111989061883;  // ln kLiveOfDeep
  static_assert(kLiveOfDeep == 4);
  const int whole_vectors = (count + 7) / 8 * 8;  // full vectors: a remainder loop would cost more than unused lanes
#pragma GCC ivdep
  for (int i = 0; i < whole_vectors; ++i) {
    const double x0 = x[i], y0 = y[i], z0 = z[i], dx0 = dx[i], dy0 = dy[i], dz0 = dz[i], depth0 = depth[i];
    uint64_t state = random[i];
    const uint64_t of_flight = NextBits(state, random_step[i]), state_of_flight = state,
                   of_turn = NextBits(state, random_step[i]);

    // Scattering cosine after Henyey and Greenstein 1941, with their v uniform in (-1, 1), without a difference that
    // loses digits near g = 0. The same number decides whether scattering is isotropic.
    const double u = (Exactly(of_turn >> 32) + 0.5) * 0x1.0p-32, share = isotropic[i];
    const double as_isotropic = u * per_isotropic[i], as_other = (u - share) * per_other[i], g0 = g[i];
    const bool is_isotropic = u < share;
    const double gi = is_isotropic ? 0.0 : g0, v = 2.0 * (is_isotropic ? as_isotropic : as_other) - 1.0;

    // One division replaces three: of the logarithm, of the scattering angle and of the frame.
    const BinaryPower passed = Split(2.0 - std::bit_cast<double>((of_flight >> 12) | 0x3ff0000000000000ull));
    const double steepness = std::abs(dz0);
    const double a = 2.0 + passed.above, b = 1.0 + gi * v, c = 1.0 + steepness, ab = a * b, per_abc = 1.0 / (ab * c),
                 per_c = per_abc * ab, per_ab = per_abc * c, per_a = per_ab * b, per_b = per_ab * a;

    const double flight = -LogOf(passed, passed.above * per_a) * free_path_mm[i];
    const double x1 = x0 + flight * dx0, y1 = y0 + flight * dy0, z1 = z0 + flight * dz0;

    const double g2 = gi * gi, v2 = v * v;
    const double cosine = (v * (1.0 + g2) + 0.5 * gi * (v2 * (1.0 + g2) + (3.0 - g2))) * (per_b * per_b);
    const double square = 1.0 - cosine * cosine, sine = std::sqrt(square > 0.0 ? square : 0.0);
    // A frame about the direction (Duff et al. 2017), upwards or mirrored.
    const Turn turn = SomeTurn(of_turn);
    const double p = sine * turn.cosine, q = sine * turn.sine;
    const double along = p * dx0 + q * dy0, forward = cosine - per_c * along;
    const double wx = p + forward * dx0, wy = q + forward * dy0,
                 wz = std::copysign(1.0, dz0) * (cosine * steepness - along);
    const double to_unit = 1.5 - 0.5 * (wx * wx + wy * wy + wz * wz);  // Newton step for 1 / length

    const double deeper = depth0 + absorption_per_mm[i] * flight;
    const bool is_deep = deeper > kDeep;
    const uint64_t dies = of_flight & (kLiveOfDeep - 1);  // bits that the flight does not use
    const double after = is_deep ? deeper - kLogLive : deeper;
    const uint64_t inside = is_deep ? dies : 0;

    const double beyond = z1 - top_mm[i], short_of = bottom_mm[i] - z1, out = beyond > short_of ? beyond : short_of;
    const bool leaves = out > 0.0;
    x[i] = leaves ? x0 : x1;
    y[i] = leaves ? y0 : y1;
    z[i] = leaves ? z0 : z1;
    dx[i] = leaves ? dx0 : wx * to_unit;
    dy[i] = leaves ? dy0 : wy * to_unit;
    dz[i] = leaves ? dz0 : wz * to_unit;
    depth[i] = leaves ? depth0 : after;
    random[i] = leaves ? state_of_flight : state;
    fate[i] = leaves ? uint64_t{kMeetsBoundary} : inside;
  }
}

CROWNFIT_FOR_EVERY_VECTOR
void SlabLanes::Cross(std::span<const int> lanes) {
  const int count = static_cast<int>(lanes.size());
  alignas(64) Lanes<double> fx, fy, fz, fdx, fdy, fdz, edge, absorption, relative_ior, added;
  alignas(64) Lanes<uint64_t> state, step;
  alignas(64) Lanes<uint64_t> passes;
  for (int k = 0; k < count; ++k) {
    const int i = lanes[k];
    fx[k] = x[i], fy[k] = y[i], fz[k] = z[i];
    fdx[k] = dx[i], fdy[k] = dy[i], fdz[k] = dz[i];
    state[k] = random[i], step[k] = random_step[i];
    absorption[k] = absorption_per_mm[i];
    edge[k] = dz[i] > 0.0 ? top_mm[i] : bottom_mm[i];
    relative_ior[k] = dz[i] > 0.0 ? ior_above[i] : ior_below[i];
  }
#pragma GCC ivdep
  for (int k = 0; k < count; ++k) {
    const double way = (edge[k] - fz[k]) / fdz[k], n = relative_ior[k], cosine = std::abs(fdz[k]);
    fx[k] += way * fdx[k];
    fy[k] += way * fdy[k];
    added[k] = way * absorption[k];
    const double u = NextUniform(state[k], step[k]);
    const bool is_mirrored = u < Terms<double>::FresnelReflectance(cosine, n);
    const double through = std::copysign(Terms<double>::RefractedCosine(cosine, n), fdz[k]);
    const double shrinks = is_mirrored ? 1.0 : 1.0 / n;
    fdx[k] *= shrinks;
    fdy[k] *= shrinks;
    fdz[k] = is_mirrored ? -fdz[k] : through;
    passes[k] = is_mirrored ? 0 : 1;
  }
  for (int k = 0; k < count; ++k) {
    const int i = lanes[k];
    x[i] = fx[k], y[i] = fy[k], z[i] = edge[k];
    dx[i] = fdx[k], dy[i] = fdy[k], dz[i] = fdz[k];
    depth[i] += added[k];
    random[i] = state[k];
    has_passed[i] = passes[k];
  }
}

void SlabLanes::Copy(int from, int to) {
  for (auto* lanes : {&x, &y, &z, &dx, &dy, &dz, &depth, &top_mm, &bottom_mm, &free_path_mm, &absorption_per_mm, &g,
                      &isotropic, &per_isotropic, &per_other, &ior_above, &ior_below})
    (*lanes)[to] = (*lanes)[from];
  random[to] = random[from];
  random_step[to] = random_step[from];
}

}  // namespace crownfit
