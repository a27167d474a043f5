#pragma once
// Work beside the main thread, for programs that must go on answering.

#include <functional>
#include <future>
#include <string>
#include <vector>

namespace crownfit {

/// One piece of work at a time. The work ends in a function that the main thread runs, so that only the main thread
/// touches what it shows.
class Background {
 public:
  using Finish = std::function<void()>;

  /// Starts `work` on a thread of its own. What still runs is not waited for, and its end is never run.
  void Start(const std::string& what, std::function<Finish()> work);
  bool IsBusy() const { return current_.valid(); }
  const std::string& what() const { return what_; }
  /// Runs the end of finished work. True when there was one. What the work has thrown comes out here.
  bool Poll();

 private:
  std::future<Finish> current_;
  std::vector<std::future<Finish>> forgotten_;
  std::string what_;
};

}  // namespace crownfit
