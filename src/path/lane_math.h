#pragma once
// Elementary functions for loops over lanes. They have no branches, tables or calls, so that compilers vectorise them.
// They use operations that every instruction set rounds alike.

#include <bit>
#include <cstdint>

namespace crownfit {

/// The next 64 bits of a lane's stream; advances its state with RandomStream's arithmetic.
[[gnu::always_inline]] inline uint64_t NextBits(uint64_t& state, uint64_t step) {
  uint64_t x = state += step;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// An integer below 2^52 as a double, as the mantissa of 2^52 + x: older vector instruction sets lack the conversion.
[[gnu::always_inline]] inline double Exactly(uint64_t x) {
  return std::bit_cast<double>(x | 0x4330000000000000ull) - 0x1.0p52;
}

/// As RandomStream::Next.
[[gnu::always_inline]] inline double NextUniform(uint64_t& state, uint64_t step) {
  const uint64_t x = NextBits(state, step) >> 11;
  // Both halves as mantissas; exact below 2^53.
  const double low = std::bit_cast<double>((x & 0xffffffffull) | 0x4330000000000000ull);  // 2^52 + low
  const double high = std::bit_cast<double>((x >> 32) | 0x4530000000000000ull);           // 2^84 + 2^32 high
  return ((high - 0x1.00000001p84) + low) * 0x1.0p-53;
}

/// x = 2^power (1 + above), above within [sqrt(1/2) - 1, sqrt(2) - 1].
struct BinaryPower {
  double power, above;
};
[[gnu::always_inline]] inline BinaryPower Split(double x) {
  const uint64_t bits = std::bit_cast<uint64_t>(x), sqrt_half = 0x3fe6a09e667f3bcdull;
  const uint64_t exponent = (bits - sqrt_half + (1023ull << 52)) >> 52;  // of x / sqrt(1/2), biased
  const double m = std::bit_cast<double>(bits - ((exponent - 1023ull) << 52));
  return {std::bit_cast<double>(exponent | 0x4330000000000000ull) - (0x1.0p52 + 1023.0), m - 1.0};
}

/// ln(x) for normal x in (0, 1], split: the polynomial of fdlibm (Sun 1993), below 1 ulp. `s`: above / (2 + above).
[[gnu::always_inline]] inline double LogOf(const BinaryPower& x, double s) {
  const double f = x.above, z = s * s, w = z * z;
  const double even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
  const double odd =
      z * (6.666666666666735130e-01 +
           w * (2.857142874366239149e-01 + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
  const double half_square = 0.5 * f * f;
  return x.power * 6.93147180369123816490e-01 -
         ((half_square - (s * (half_square + even + odd) + x.power * 1.90821492927058770002e-10)) - f);
}
[[gnu::always_inline]] inline double Log(double x) {
  const BinaryPower split = Split(x);
  return LogOf(split, split.above / (2.0 + split.above));
}

struct Turn {
  double cosine, sine;
};
/// Rotation by an angle within [-pi/4, pi/4]: fdlibm's polynomials.
[[gnu::always_inline]] inline Turn TurnWithinEighth(double angle) {
  const double r = angle, z = r * r;
  const double sine = r + r * z *
                              (-1.66666666666666324348e-01 +
                               z * (8.33333333332248946124e-03 +
                                    z * (-1.98412698298579493134e-04 +
                                         z * (2.75573137070700676789e-06 +
                                              z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)))));
  const double cosine = 1.0 - 0.5 * z +
                        z * z *
                            (4.16666666666666019037e-02 +
                             z * (-1.38888888888741095749e-03 +
                                  z * (2.48015872894767294178e-05 +
                                       z * (-2.75573143513906633035e-07 +
                                            z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  return {cosine, sine};
}

/// exp(x) for x within [-87, 0], to 2e-7: 2^n times the Taylor polynomial of 2^f, |f| at most 1/2.
[[gnu::always_inline]] inline float ExpOf(float x) {
  const float t = x * 1.44269504f, n = (t + 0x1.8p23f) - 0x1.8p23f, f = (t - n) * 0.693147181f;
  const float of_f =
      1.0f +
      f * (1.0f + f * (0.5f + f * (0.166666667f + f * (0.0416666667f + f * (0.00833333333f + f * 0.00138888889f)))));
  const auto power = std::bit_cast<uint32_t>(n + (0x1.8p23f + 127.0f)) << 23;
  return std::bit_cast<float>(power) * of_f;
}

/// Rotation by 2 pi u for u in [0, 1): whole quarters, and the remainder.
[[gnu::always_inline]] inline Turn TurnBy(double u) {
  const double quarters = 4.0 * u, whole = (quarters + 0x1.8p52) - 0x1.8p52;  // rounded
  const auto [cosine, sine] = TurnWithinEighth((quarters - whole) * 1.57079632679489661923);
  const bool is_odd = whole == 1.0 || whole == 3.0;
  const double c = is_odd ? sine : cosine, s = is_odd ? cosine : sine;
  return {whole == 1.0 || whole == 2.0 ? -c : c, whole == 2.0 || whole == 3.0 ? -s : s};
}

/// Uniformly distributed rotation from 32 random bits: an angle within an eighth turn, mirrored at the diagonal or not,
/// reversed or not.
[[gnu::always_inline]] inline Turn SomeTurn(uint64_t bits) {
  constexpr double kUnit = 1.57079632679489661923 * 0x1.0p-30;
  const auto [cosine, sine] = TurnWithinEighth((Exactly(bits & 0x3fffffffull) - (0x1.0p29 - 0.5)) * kUnit);
  const bool is_mirrored = (bits & 0x40000000ull) != 0;
  const uint64_t turned_round = (bits & 0x80000000ull) << 32;
  const auto with_sign = [&](double x) { return std::bit_cast<double>(std::bit_cast<uint64_t>(x) ^ turned_round); };
  return {with_sign(is_mirrored ? sine : cosine), with_sign(is_mirrored ? cosine : sine)};
}

}  // namespace crownfit
