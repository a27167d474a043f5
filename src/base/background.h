#pragma once
// Background work for programs that must stay responsive.

#include <functional>
#include <future>
#include <string>
#include <vector>

namespace crownfit {

/// Runs one task at a time. A task returns a function that the main thread runs at its end, so only the main thread
/// touches what it shows.
class Background {
 public:
  using Finish = std::function<void()>;

  /// Starts `work` on its own thread. A task that still runs is abandoned: its end function is never run.
  void Start(const std::string& what, std::function<Finish()> work);
  bool IsBusy() const { return current_.valid(); }
  const std::string& what() const { return what_; }
  /// Runs the end function of finished work; true when there was one. Rethrows the exceptions of the work.
  bool Poll();

 private:
  std::future<Finish> current_;
  std::vector<std::future<Finish>> forgotten_;
  std::string what_;
};

}  // namespace crownfit
