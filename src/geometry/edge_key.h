#pragma once

#include <algorithm>
#include <cstdint>

namespace crownfit {

/// An edge by its vertices, whichever way it runs.
inline uint64_t EdgeKey(int a, int b) {
  return (static_cast<uint64_t>(std::min(a, b)) << 32) | static_cast<uint32_t>(std::max(a, b));
}

}  // namespace crownfit
