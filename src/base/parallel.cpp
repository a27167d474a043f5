#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace crownfit {

void ParallelFor(size_t count, int threads, const std::function<void(size_t)>& body) {
  const size_t wanted = threads > 0 ? static_cast<size_t>(threads) : std::max(1u, std::thread::hardware_concurrency());
  const size_t workers = std::min(wanted, count);
  // Many small tasks are taken in chunks, so that the counter is not contended; few tasks are taken one at a time.
  const size_t chunk = std::clamp<size_t>(count / (16 * std::max<size_t>(1, workers)), 1, 64);
  std::atomic<size_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&] {
    try {
      for (size_t begin = next.fetch_add(chunk); begin < count; begin = next.fetch_add(chunk))
        for (size_t i = begin; i < std::min(count, begin + chunk); ++i) body(i);
    } catch (...) {
      const std::lock_guard lock(error_mutex);
      if (!error) error = std::current_exception();
      next = count;
    }
  };
  std::vector<std::thread> pool;
  for (size_t t = 1; t < workers; ++t) pool.emplace_back(work);
  work();
  for (auto& thread : pool) thread.join();
  if (error) std::rethrow_exception(error);
}

}  // namespace crownfit
