#include "base/confined.h"

#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <sstream>
#include <string>
#include <system_error>

#include "base/error.h"

namespace crownfit {
namespace {

constexpr int kSaidWhatIsWrong = 10, kNoMemory = 11, kOtherException = 12;  // exit codes of a child

/// Address space of this process.
size_t BytesInUse() {
  size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<size_t>(sysconf(_SC_PAGESIZE));
}

void Confine(const Confinement& limits) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a child does not outlive its parent
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  rlimit memory{};
  getrlimit(RLIMIT_AS, &memory);
  memory.rlim_cur = std::min<rlim_t>(memory.rlim_max, BytesInUse() + limits.memory_bytes);
  setrlimit(RLIMIT_AS, &memory);
  // The alarm ends the child even while it waits for a lock that nobody holds any more.
  signal(SIGALRM, SIG_DFL);
  sigset_t alarm_only;
  sigemptyset(&alarm_only);
  sigaddset(&alarm_only, SIGALRM);
  sigprocmask(SIG_UNBLOCK, &alarm_only, nullptr);
  alarm(static_cast<unsigned>(std::ceil(limits.seconds)));
}

[[noreturn]] void BeTheChild(const Confinement& limits, const std::function<void()>& work, std::span<std::byte> said) {
  Confine(limits);
  int code = 0;
  try {
    work();
  } catch (const InputError& e) {
    std::strncpy(reinterpret_cast<char*>(said.data()), e.what(), said.size() - 1);
    code = kSaidWhatIsWrong;
  } catch (const std::bad_alloc&) {
    code = kNoMemory;
  } catch (...) {  // a library's exception: only the exit code can report it
    code = kOtherException;
  }
  _exit(code);  // runs no destructors and writes no output that the parent has buffered
}

/// Processor ticks that a process has used; -1 when it no longer exists.
long TicksOf(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 2)));  // the name may contain spaces
  std::string skipped;
  for (int i = 0; i < 11; ++i) fields >> skipped;
  long user = -1, system = 0;
  fields >> user >> system;
  return user < 0 ? -1 : user + system;
}

/// Waits for the process to end. False when it uses no processor time for a while.
bool WaitWhileItWorks(pid_t process) {
  constexpr int kWhile_ms = 3000;
  const int file = static_cast<int>(syscall(SYS_pidfd_open, process, 0));
  if (file < 0) return true;  // an old kernel: wait for the time limit instead
  pollfd watched{file, POLLIN, 0};
  int ended = 0;
  for (long before = -1, now = 0; ended == 0 && now != before;) {
    before = now;
    while ((ended = poll(&watched, 1, kWhile_ms)) < 0 && errno == EINTR) continue;
    now = TicksOf(process);
  }
  close(file);
  return ended != 0;
}

}  // namespace

SharedMemory::SharedMemory() : file_(memfd_create("crownfit", MFD_CLOEXEC)) {
  if (file_ < 0) throw std::system_error(errno, std::generic_category(), "memfd_create");
}

SharedMemory::~SharedMemory() {
  Unmap();
  close(file_);
}

void SharedMemory::Unmap() {
  if (!mapped_.empty()) munmap(mapped_.data(), mapped_.size());
  mapped_ = {};
}

void SharedMemory::Resize(size_t size) {
  Unmap();
  if (ftruncate(file_, static_cast<off_t>(size)) != 0) throw std::bad_alloc();
}

std::span<std::byte> SharedMemory::Bytes() {
  Unmap();
  struct stat status {};
  fstat(file_, &status);
  const auto size = static_cast<size_t>(status.st_size);
  if (size == 0) return {};
  void* data = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, file_, 0);
  if (data == MAP_FAILED) throw std::bad_alloc();
  mapped_ = {static_cast<std::byte*>(data), size};
  return mapped_;
}

Ending RunConfined(const Confinement& limits, const std::function<void()>& work) {
  SharedMemory said;
  said.Resize(4096);
  const std::span<std::byte> text = said.Bytes();
  // A child forked while another thread held a library's lock waits for that lock for ever. Such a child is killed and
  // replaced, except the last one, which may be waiting for a slow disk.
  constexpr int kMostChildren = 3;
  int status = 0;
  for (int number = 1; number <= kMostChildren; ++number) {
    const pid_t child = fork();
    if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
    if (child == 0) BeTheChild(limits, work, text);
    const bool is_given_up = number < kMostChildren && !WaitWhileItWorks(child);
    if (is_given_up) kill(child, SIGKILL);
    while (waitpid(child, &status, 0) < 0)
      if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "waitpid");
    if (!is_given_up) break;
  }
  if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGALRM ? Ending::kTookTooLong : Ending::kCrashed;
  const int code = WEXITSTATUS(status);
  if (code == kSaidWhatIsWrong) throw InputError("", "", reinterpret_cast<const char*>(text.data()));
  return code == 0 ? Ending::kDone : code == kNoMemory ? Ending::kNeededTooMuchMemory : Ending::kCrashed;
}

}  // namespace crownfit
