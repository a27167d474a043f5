#pragma once
// Child processes that can't harm this one: their time and memory are limited, and they are killed when this one dies.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace crownfit {

struct ProcessLimits {
  double seconds = 3600;
  double memory_MiB = 0;  ///< resident; 0: no limit
};

struct ProcessEnd {
  int exit_code = -1;  ///< -1: killed by a signal
  int signal = 0;
  bool was_too_slow = false, was_too_large = false;
  double wall_s = 0, cpu_s = 0, peak_MiB = 0;  ///< cpu_s: of all its threads
};

class ProcessPool {
 public:
  explicit ProcessPool(const ProcessLimits& limits) : limits_(limits) {}
  ~ProcessPool() { KillAll(); }
  ProcessPool(const ProcessPool&) = delete;
  ProcessPool& operator=(const ProcessPool&) = delete;

  /// Starts `arguments[0]` with standard output discarded and standard error written to a file. Throws InputError when
  /// it can't be started.
  void Start(size_t job, const std::vector<std::string>& arguments, const std::filesystem::path& standard_error);
  /// The next process that ends; absent when `seconds` pass or a signal arrives first.
  std::optional<std::pair<size_t, ProcessEnd>> Wait(double seconds);
  void KillAll();
  size_t count() const { return running_.size(); }

 private:
  struct Running {
    int pid, handle;  ///< handle: becomes readable when the process ends
    double begin_s;
    ProcessEnd end;  ///< as far as known
  };
  void WatchLimits(Running& process) const;
  ProcessLimits limits_;
  std::map<size_t, Running> running_;
};

/// "exit code 2", "killed by signal 11 (Segmentation fault)", "took longer than 60 s", ...
std::string Words(const ProcessEnd& end, const ProcessLimits& limits);

}  // namespace crownfit
