#pragma once
// Work by libraries that may crash or hang on a broken file: done in a forked child, so that they take nothing with
// them.
//
// A child shares everything that was in memory when it was forked: some milliseconds for the tables, and no copies;
// what it makes reaches its parent through SharedMemory alone. It sees none of its parent's other threads: `work` must
// neither wait for one nor take a lock that one may hold.

#include <cstddef>
#include <functional>
#include <span>

namespace crownfit {

/// Bytes that parent and child both see. Made before the child; the child resizes and fills it, the parent looks after.
class SharedMemory {
 public:
  SharedMemory();
  ~SharedMemory();
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;

  /// So many bytes, zeros where nothing was written. Throws std::bad_alloc.
  void Resize(size_t size);
  /// All of it, as it stands now. Throws std::bad_alloc.
  std::span<std::byte> Bytes();

 private:
  void Unmap();
  int file_ = -1;
  std::span<std::byte> mapped_;
};

struct Confinement {
  double seconds = 60;             ///< by the clock, rounded up
  size_t memory_bytes = 1u << 30;  ///< over what the parent has
};

enum class Ending { kDone, kTookTooLong, kNeededTooMuchMemory, kCrashed };

/// Runs `work` in a child and waits for its end; anew where the child does nothing for seconds, as it may wait for a
/// lock that a library's own thread held at the fork. An InputError that it throws is thrown again here.
Ending RunConfined(const Confinement& limits, const std::function<void()>& work);

}  // namespace crownfit
