#pragma once
// Loops over independent items. Each item writes only what belongs to its index, so results do not depend on threads.

#include <cstddef>
#include <functional>

namespace crownfit {

/// Calls body(i) for every i in [0, count) on `threads` threads (0: one per processor). Exceptions reach the caller.
void ParallelFor(size_t count, int threads, const std::function<void(size_t)>& body);

}  // namespace crownfit
