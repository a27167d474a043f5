#pragma once
// Counter-based random numbers: a hash of a key and an index, so results depend neither on order nor on threads.

#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace crownfit {

/// Finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection on 64 bits that passes BigCrush on counters.
constexpr uint64_t Mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// One key from several counters (seed, photograph, pixel, ...).
template <class... Counters>
constexpr uint64_t Key(uint64_t first, Counters... rest) {
  uint64_t key = Mix(first);
  ((key = Mix(key ^ Mix(static_cast<uint64_t>(rest)))), ...);
  return key;
}

/// Uniform in [0, 1), 53 bits.
constexpr double Uniform(uint64_t key, uint64_t index) {
  return static_cast<double>(Key(key, index) >> 11) * 0x1.0p-53;
}

/// Gaussian of unit variance (Box and Muller 1958).
inline double Gaussian(uint64_t key, uint64_t index) {
  return std::sqrt(-2.0 * std::log(1.0 - Uniform(key, 2 * index))) *
         std::cos(2.0 * std::numbers::pi * Uniform(key, 2 * index + 1));
}

/// Fast generator of many numbers for one key: number i is the mix of start + i step, both drawn from the key (the
/// split generator of Steele, Lea and Flood 2014, with its rule for weak steps). Streams of different keys do not
/// overlap.
class RandomStream {
 public:
  explicit RandomStream(uint64_t key) : state_(Mix(key)), step_(Mix(key ^ 0x632be59bd9b4e019ull) | 1) {
    if (std::popcount(step_ ^ (step_ >> 1)) < 24) step_ ^= 0xaaaaaaaaaaaaaaaaull;
  }
  /// Uniform in [0, 1), 53 bits.
  double Next() {
    uint64_t x = state_ += step_;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1.0p-53;
  }
  /// For loops that draw from many streams at once.
  uint64_t state() const { return state_; }
  uint64_t step() const { return step_; }
  void set_state(uint64_t state) { state_ = state; }

 private:
  uint64_t state_, step_;
};

}  // namespace crownfit
