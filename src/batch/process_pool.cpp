#include "batch/process_pool.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "base/error.h"
#include "base/text.h"

namespace crownfit {
namespace {

constexpr double kLook_s = 0.05;  // between checks of time and memory

double Now_s() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double Resident_MiB(int pid) {
  const std::string name = Printed("/proc/%d/statm", pid);
  std::FILE* file = std::fopen(name.c_str(), "r");
  if (!file) return 0;
  double size = 0, resident = 0;
  const int read = std::fscanf(file, "%lf %lf", &size, &resident);
  std::fclose(file);
  return read == 2 ? resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20) : 0;
}

}  // namespace

void ProcessPool::Start(size_t job, const std::vector<std::string>& arguments,
                        const std::filesystem::path& standard_error) {
  std::vector<char*> words;
  for (const std::string& a : arguments) words.push_back(const_cast<char*>(a.c_str()));
  words.push_back(nullptr);
  const int errors = open(standard_error.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  if (errors < 0)
    throw InputError(standard_error, "", std::string("can't be written: ") + std::strerror(errno),
                     "Free some space or choose another output folder, and run the same command again.");
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  const int parent = getpid(), pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(127);  // the parent died before the line above
    dup2(nothing, STDIN_FILENO);
    dup2(nothing, STDOUT_FILENO);
    dup2(errors, STDERR_FILENO);
    execv(words[0], words.data());
    std::fprintf(stderr, "%s: %s\n", words[0], std::strerror(errno));
    _exit(127);
  }
  close(errors);
  close(nothing);
  const int handle = pid < 0 ? -1 : static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
  if (handle < 0) {
    const std::string reason = std::strerror(errno);
    if (pid > 0) kill(pid, SIGKILL);
    throw InputError("", "", "a process can't be started: " + reason, "Run with fewer --jobs.");
  }
  running_[job] = {pid, handle, Now_s(), {}};
}

void ProcessPool::WatchLimits(Running& process) const {
  const double resident = Resident_MiB(process.pid);
  process.end.was_too_slow |= Now_s() - process.begin_s > limits_.seconds;
  process.end.was_too_large |= limits_.memory_MiB > 0 && resident > limits_.memory_MiB;
  process.end.peak_MiB = std::max(process.end.peak_MiB, resident);
  if (process.end.was_too_slow || process.end.was_too_large) kill(process.pid, SIGKILL);
}

std::optional<std::pair<size_t, ProcessEnd>> ProcessPool::Wait(double seconds) {
  const double until = Now_s() + seconds;
  std::vector<pollfd> handles;
  for (const auto& [job, process] : running_) handles.push_back({process.handle, POLLIN, 0});
  do {
    const double wait_s = std::clamp(until - Now_s(), 0.0, kLook_s);
    if (poll(handles.data(), handles.size(), static_cast<int>(std::ceil(1000 * wait_s))) < 0) return std::nullopt;
    for (auto at = running_.begin(); at != running_.end(); ++at) {
      const size_t index = static_cast<size_t>(std::distance(running_.begin(), at));
      if (handles[index].revents == 0) {
        WatchLimits(at->second);
        continue;
      }
      int status = 0;
      rusage used{};
      wait4(at->second.pid, &status, 0, &used);
      close(at->second.handle);
      ProcessEnd end = at->second.end;
      end.wall_s = Now_s() - at->second.begin_s;
      end.cpu_s = Seconds(used.ru_utime) + Seconds(used.ru_stime);
      end.peak_MiB = std::max(end.peak_MiB, static_cast<double>(used.ru_maxrss) / 1024);
      if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
      if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
      const size_t job = at->first;
      running_.erase(at);
      return std::pair{job, end};
    }
  } while (Now_s() < until);
  return std::nullopt;
}

void ProcessPool::KillAll() {
  for (const auto& [job, process] : running_) {
    kill(process.pid, SIGKILL);
    waitpid(process.pid, nullptr, 0);
    close(process.handle);
  }
  running_.clear();
}

std::string Words(const ProcessEnd& end, const ProcessLimits& limits) {
  if (end.was_too_slow) return Printed("took longer than %g s (--time-limit)", limits.seconds);
  if (end.was_too_large) return Printed("used more than %g MiB of memory (--memory-limit)", limits.memory_MiB);
  if (end.signal != 0) return Printed("killed by signal %d (%s)", end.signal, strsignal(end.signal));
  return Printed("exit code %d", end.exit_code);
}

}  // namespace crownfit
