#pragma once
// Runs library calls that may crash or hang on a broken file in a forked child, which protects this process.
//
// A fork copies only the page tables, which takes some milliseconds, and the child sees everything in memory. Its
// results reach the parent through SharedMemory alone. The child has none of its parent's other threads: `work` must
// neither wait for one nor take a lock that one may hold.

#include <cstddef>
#include <functional>
#include <span>

namespace crownfit {

/// Memory shared by parent and child. Created before the fork; the child resizes and fills it, the parent reads it
/// afterwards.
class SharedMemory {
 public:
  SharedMemory();
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// Sets the size; unwritten bytes are zero. Throws std::bad_alloc.
  void Resize(size_t size);
  /// The whole memory at its current size. Throws std::bad_alloc.
  std::span<std::byte> Bytes();

 private:
  void Unmap();
  int file_ = -1;
  std::span<std::byte> mapped_;
};

struct Confinement {
  double seconds = 60;             ///< wall-clock time, rounded up
  size_t memory_bytes = 1u << 30;  ///< beyond what the parent uses
};

enum class Ending { kDone, kTookTooLong, kNeededTooMuchMemory, kCrashed };

/// Runs `work` in a child and waits for its end. Restarts a child that uses no processor time for seconds, because it
/// may wait for a lock that a library's thread held at the fork. Rethrows an InputError of `work`.
Ending RunConfined(const Confinement& limits, const std::function<void()>& work);

}  // namespace crownfit
