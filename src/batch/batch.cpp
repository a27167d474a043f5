#include "batch/batch.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <deque>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "base/error.h"
#include "base/files.h"

namespace crownfit {
namespace {

namespace fs = std::filesystem;
using Say = std::function<void(std::string)>;

volatile std::sig_atomic_t g_signal = 0;
void TakeSignal(int signal) { g_signal = signal; }

/// While it lives, SIGINT and SIGTERM only set g_signal, and interrupt what waits.
class Signals {
 public:
  Signals() {
    g_signal = 0;
    struct sigaction action {};
    action.sa_handler = TakeSignal;
    for (size_t i = 0; i < 2; ++i) sigaction(kSignals[i], &action, &before_[i]);
  }
  ~Signals() {
    for (size_t i = 0; i < 2; ++i) sigaction(kSignals[i], &before_[i], nullptr);
  }
  Signals(const Signals&) = delete;
  Signals& operator=(const Signals&) = delete;

 private:
  static constexpr int kSignals[] = {SIGINT, SIGTERM};
  struct sigaction before_[2];
};

void MakeFolder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error)
    throw InputError(folder, "", "the folder can't be made: " + error.message(), "Choose a folder you may write to.");
}

/// One batch at a time works in a folder; the lock goes with the process, however it ends.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder) {
    const fs::path file = folder / "batch.lock";
    handle_ = open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (handle_ < 0)
      throw InputError(file, "", std::string("can't be written: ") + std::strerror(errno),
                       "Choose an output folder you may write to.");
    if (flock(handle_, LOCK_EX | LOCK_NB) == 0) {
      char host[256] = "";
      gethostname(host, sizeof host - 1);
      const std::string who = std::string(host) + ", process " + std::to_string(getpid()) + "\n";
      if (ftruncate(handle_, 0) == 0) [[maybe_unused]]
        const auto ignored = write(handle_, who.data(), who.size());
      return;
    }
    close(handle_);
    std::ifstream stream(file);
    std::string who;
    std::getline(stream, who);
    throw InputError(folder, "", "another batch works here (" + who + ")",
                     "Wait for it, stop it, or give this one another folder.");
  }
  ~FolderLock() { close(handle_); }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int handle_;
};

/// The folder of a batch. Whatever is written is made in work/ and then moved to its place.
class BatchFolder {
 public:
  explicit BatchFolder(const fs::path& root) : root_(root) {
    MakeFolder(root_);
    lock_.emplace(root_);
    std::error_code ignored;
    fs::remove_all(work(), ignored);  // of a batch that was killed
    MakeFolder(work() / "crowns");
    MakeFolder(work() / "stderr");
    MakeFolder(root_ / "crowns");
  }
  ~BatchFolder() {
    std::error_code ignored;
    fs::remove_all(work(), ignored);
  }
  BatchFolder(const BatchFolder&) = delete;
  BatchFolder& operator=(const BatchFolder&) = delete;

  fs::path work() const { return root_ / "work"; }
  fs::path crown(const std::string& id) const { return root_ / "crowns" / id; }

  void Write(const fs::path& name, const std::string& text) const {
    WriteTextFile(work() / name.filename(), text);
    std::error_code error;
    if (name.has_parent_path()) MakeFolder(root_ / name.parent_path());
    fs::rename(work() / name.filename(), root_ / name, error);
    if (error) throw InputError(root_ / name, "", "can't be written: " + error.message(), "");
  }
  /// A whole crown at once, in place of an older one.
  void Keep(const fs::path& made, const std::string& id) const {
    std::error_code error;
    if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, crown(id).c_str(), RENAME_EXCHANGE) == 0) {
      fs::remove_all(made, error);
    } else {  // there is no older one, or a file system that can't exchange
      fs::remove_all(crown(id), error);
      fs::rename(made, crown(id), error);
      if (error) throw InputError(crown(id), "", "can't be written: " + error.message(), "");
    }
    fs::remove(root_ / "failed" / (id + ".json"), error);
    fs::remove(root_ / "failed", error);  // when it is empty
  }
  /// An older result is of other inputs, and goes.
  void KeepFailure(const std::string& id, const std::string& reason, const std::string& standard_error) const {
    Write(fs::path("failed") / (id + ".json"),
          ToJsonText(JsonValue::Object{{"id", id}, {"reason", reason}, {"stderr", standard_error}}));
    std::error_code ignored;
    fs::remove_all(crown(id), ignored);
  }
  /// Throws when that may be why a crown failed: the next ones would too.
  void CheckRoom(const std::string& failure) const {
    constexpr uintmax_t kLeast = 16 << 20;
    std::error_code error;
    const auto space = fs::space(root_, error);
    if (!error && space.available < kLeast)
      throw InputError(root_, "",
                       "the disk is full (" + std::to_string(space.available >> 10) + " KiB left): " + failure,
                       "Make room and run the same command again; what is finished stays.");
  }

 private:
  fs::path root_;
  std::optional<FolderLock> lock_;
};

fs::path FolderOf(const ManifestRow& row) {
  return fs::is_directory(row.capture) ? row.capture : row.capture.parent_path();
}

/// What is already there.
std::vector<CrownOutcome> Survey(const std::vector<ManifestRow>& rows, const BatchFolder& folder) {
  std::vector<CrownOutcome> crowns;
  for (const ManifestRow& row : rows) {
    CrownOutcome& crown = crowns.emplace_back(CrownOutcome{row, CrownState::kWaiting, row.fault, {}});
    if (!row.fault.empty()) {
      crown.state = CrownState::kFaulty;
      continue;
    }
    auto record = ReadRecord(folder.crown(row.id) / kRecordName);
    if (!record) continue;
    const Freshness freshness = Compare(*record, FolderOf(row), row.arguments);
    if (freshness == Freshness::kStale) continue;
    if (freshness == Freshness::kRestamped) {
      WriteRecord(folder.work() / kRecordName, *record);
      fs::rename(folder.work() / kRecordName, folder.crown(row.id) / kRecordName);
    }
    crown.state = CrownState::kFitted;
    record->files = {};  // of thousands of crowns they are most of the memory, and no longer needed
    crown.record = std::move(record);
  }
  return crowns;
}

std::string EndOf(const fs::path& file, std::streamoff most = 4000) {
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) return "";
  const std::streamoff size = stream.tellg();
  stream.seekg(std::max<std::streamoff>(0, size - most));
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

/// The pool's work: crowns that wait, one process each.
class Fitting {
 public:
  Fitting(const BatchOptions& options, const BatchFolder& folder, std::vector<CrownOutcome>& crowns, Progress& progress,
          const Say& say)
      : options_(options), folder_(folder), crowns_(crowns), progress_(progress), say_(say), pool_(options.limits) {
    const int processors = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    jobs_ = options.jobs > 0 ? options.jobs : processors;
    threads_ = options.threads > 0 ? options.threads : std::max(1, processors / jobs_);
    for (size_t i = 0; i < crowns.size(); ++i)
      if (crowns[i].state == CrownState::kWaiting) waiting_.push_back(i);
    to_do_ = waiting_.size();
  }

  /// Returns how many were fitted; stops early when g_signal is set.
  size_t Run() {
    begin_ = Clock::now();
    while (g_signal == 0 && (!waiting_.empty() || pool_.count() > 0)) {
      while (!waiting_.empty() && pool_.count() < static_cast<size_t>(jobs_)) Start();
      ShowProgress();
      if (const auto ended = pool_.Wait(0.5)) Take(ended->first, ended->second);
    }
    pool_.KillAll();
    progress_.Clear();
    return fitted_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  fs::path Made(size_t i) const { return folder_.work() / "crowns" / crowns_[i].row.id; }
  fs::path Errors(size_t i) const { return folder_.work() / "stderr" / crowns_[i].row.id; }

  void Start() {
    const size_t i = waiting_.front();
    waiting_.pop_front();
    const ManifestRow& row = crowns_[i].row;
    std::error_code ignored;
    fs::remove_all(Made(i), ignored);
    std::vector<std::string> command{options_.program.string(), "fit", row.capture.string(), "-o", Made(i).string()};
    command.insert(command.end(), row.arguments.begin(), row.arguments.end());
    command.insert(command.end(), {"--threads", std::to_string(threads_), "--progress", "none"});
    begun_s_[i] = std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
    pool_.Start(i, command, Errors(i));
    in_work_.insert(i);
  }

  void Take(size_t i, const ProcessEnd& end) {
    in_work_.erase(i);
    const std::string standard_error = EndOf(Errors(i));
    CrownOutcome& crown = crowns_[i];
    if (end.exit_code == 0 || end.exit_code == 1) {
      try {
        crown.record = RecordOf(Made(i), FolderOf(crown.row), crown.row.arguments, begun_s_[i]);
        crown.record->wall_s = end.wall_s;
        crown.record->peak_MiB = end.peak_MiB;
        WriteRecord(Made(i) / kRecordName, *crown.record);
        folder_.Keep(Made(i), crown.row.id);
        crown.state = CrownState::kFitted;
        ++fitted_;
        char text[80];
        std::snprintf(text, sizeof text, " (CIEDE2000 %.2f, %.1f s)", crown.record->de00_median, end.wall_s);
        Say_(crown, StatusOf(crown) + text);
        return;
      } catch (const InputError& e) {
        folder_.CheckRoom(crown.row.id + ": " + e.what());
        Fail(i, e.what(), standard_error);
        return;
      }
    }
    std::string reason = Words(end, options_.limits);
    if (const auto said = standard_error.find("crownfit: "); said != std::string::npos && end.exit_code > 0)
      reason = standard_error.substr(said + 10, standard_error.find_last_not_of('\n') - said - 9);
    folder_.CheckRoom(crown.row.id + ": " + reason);
    const bool crashed = (end.signal != 0 || end.exit_code == 4) && !end.was_too_slow && !end.was_too_large;
    if (crashed && attempts_[i]++ < options_.retries) {
      Say_(crown, reason + ", tried again");
      waiting_.push_back(i);
      return;
    }
    Fail(i, reason, standard_error);
  }

  void Fail(size_t i, const std::string& reason, const std::string& standard_error) {
    crowns_[i].state = CrownState::kFailed;
    crowns_[i].reason = reason;
    ++failed_;
    folder_.KeepFailure(crowns_[i].row.id, reason, standard_error);
    Say_(crowns_[i], "failed: " + reason);
  }

  void Say_(const CrownOutcome& crown, const std::string& what) {
    progress_.Clear();
    say_(crown.row.id + ": " + what);
  }

  void ShowProgress() {
    const double passed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    const size_t done = fitted_ + failed_;
    std::string detail = std::to_string(done) + " of " + std::to_string(to_do_);
    if (failed_ > 0) detail += ", " + std::to_string(failed_) + " failed";
    if (done > 0) {
      const double per_s = static_cast<double>(done) / passed_s, left_s = static_cast<double>(to_do_ - done) / per_s;
      char text[80];
      std::snprintf(text, sizeof text, ", %.3g a minute, %s left", 60 * per_s,
                    left_s < 90 ? (std::to_string(static_cast<int>(std::ceil(left_s))) + " s").c_str()
                                : (std::to_string(static_cast<int>(std::ceil(left_s / 60))) + " min").c_str());
      detail += text;
    }
    std::string names;
    for (size_t i : in_work_) names += (names.empty() ? "" : " ") + crowns_[i].row.id;
    if (names.size() > 60) names = names.substr(0, 57) + "...";
    progress_.Show("fitting", static_cast<double>(done) / static_cast<double>(std::max<size_t>(1, to_do_)),
                   detail + "; in work: " + names);
  }

  const BatchOptions& options_;
  const BatchFolder& folder_;
  std::vector<CrownOutcome>& crowns_;
  Progress& progress_;
  const Say& say_;
  ProcessPool pool_;
  int jobs_ = 1, threads_ = 1;
  std::deque<size_t> waiting_;
  std::set<size_t> in_work_;
  std::map<size_t, int> attempts_;
  std::map<size_t, double> begun_s_;
  size_t to_do_ = 0, fitted_ = 0, failed_ = 0;
  Clock::time_point begin_;
};

}  // namespace

BatchOutcome RunBatch(const BatchOptions& options, Progress& progress, const Say& say) {
  const Manifest manifest = ReadManifest(options.manifest, options.fit);
  const std::string faults = manifest.AllFaults();
  if (!manifest.faults.empty() || (!faults.empty() && !options.keep_going))
    throw InputError("", "", "the manifest has faults:\n" + faults,
                     manifest.faults.empty() ? "Mend them, or fit the others alone with --keep-going." : "Mend them.");
  const Signals signals;
  const BatchFolder folder(options.output);
  folder.Write("batch.json", ToJsonText(JsonValue::Object{{"format", "crownfit-batch/1"},
                                                          {"manifest", fs::absolute(options.manifest).string()},
                                                          {"arguments", options.fit.defaults}}));
  BatchOutcome outcome;
  outcome.crowns = Survey(manifest.rows, folder);
  outcome.fitted_now = Fitting(options, folder, outcome.crowns, progress, say).Run();
  outcome.signal = g_signal;
  if (outcome.signal != 0) return outcome;
  folder.Write("summary.csv", SummaryCsv(outcome.crowns));
  folder.Write("statistics.csv", StatisticsCsv(StatisticsOf(outcome.crowns)));
  folder.Write("times.csv", TimesCsv(outcome.crowns));
  folder.Write("summary.html", SummaryHtml(outcome.crowns));
  return outcome;
}

}  // namespace crownfit
