#pragma once
// Counter-based random numbers: a hash of a key and an index, so results depend neither on order nor on threads.

#include <cstdint>

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

}  // namespace crownfit
