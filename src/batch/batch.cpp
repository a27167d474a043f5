#include "batch/batch.h"

#include <signal.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <deque>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <thread>

#include "base/error.h"
#include "base/files.h"
#include "base/text.h"

namespace crownfit {
namespace {

namespace fs = std::filesystem;

volatile std::sig_atomic_t g_signal = 0;
void TakeSignal(int signal) { g_signal = signal; }

/// While it exists, SIGINT and SIGTERM only set g_signal and interrupt waiting calls.
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

fs::path FolderOf(const ManifestRow& row) {
  return fs::is_directory(row.capture) ? row.capture : row.capture.parent_path();
}

/// Finds the crowns that are already finished. Failed ones count as waiting, to be tried again.
std::vector<CrownOutcome> Survey(std::vector<ManifestRow> rows, const fs::path& root,
                                 const std::optional<Shard>& shard) {
  std::vector<CrownOutcome> crowns;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (shard && !shard->Has(i, rows.size())) continue;
    CrownOutcome& crown = crowns.emplace_back(CrownOutcome{std::move(rows[i]), CrownState::kWaiting, "", {}});
    const ManifestRow& row = crown.row;
    if (!row.fault.empty()) {
      crown.state = CrownState::kFaulty;
      crown.reason = row.fault;
      continue;
    }
    const fs::path made = root / "crowns" / row.id;
    auto record = ReadRecord(made / kRecordName);
    if (!record || !fs::is_regular_file(made / "material.json")) continue;
    const Freshness freshness = Compare(*record, FolderOf(row), row.arguments);
    if (freshness == Freshness::kStale) continue;
    if (freshness == Freshness::kRestamped)
      WriteIntoFolder(root, fs::path("crowns") / row.id / kRecordName, RecordText(*record));
    crown.state = CrownState::kFitted;
    record->files = {};  // most of the memory for thousands of crowns, and no longer needed
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

/// Fits the waiting crowns, one process each.
class Fitting {
 public:
  Fitting(const BatchOptions& options, const BatchFolder& folder, std::vector<CrownOutcome>& crowns, Progress& progress,
          const SayNews& say)
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
        WriteTextFile(Made(i) / kRecordName, RecordText(*crown.record));
        folder_.Keep(Made(i), crown.row.id);
        crown.state = CrownState::kFitted;
        ++fitted_;
        const auto& error = crown.record->de00_median;
        Tell(crown, StatusOf(crown) + " (" + (error ? Printed("CIEDE2000 %.2f, ", *error) : "") +
                        Printed("%.1f s)", end.wall_s));
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
      Tell(crown, reason + "; it is tried again");
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
    Tell(crowns_[i], "failed: " + reason);
  }

  void Tell(const CrownOutcome& crown, const std::string& what) {
    progress_.Clear();
    say_({crown.row.id, what});
  }

  void ShowProgress() {
    const double passed_s = std::chrono::duration<double>(Clock::now() - begin_).count();
    const size_t done = fitted_ + failed_;
    std::string detail = std::to_string(done) + " of " + std::to_string(to_do_);
    if (failed_ > 0) detail += ", " + std::to_string(failed_) + " failed";
    if (done > 0) {
      const double per_s = static_cast<double>(done) / passed_s, left_s = static_cast<double>(to_do_ - done) / per_s;
      detail +=
          Printed(", %.3g per minute, ", 60 * per_s) +
          (left_s < 90 ? Printed("%.0f s left", std::ceil(left_s)) : Printed("%.0f min left", std::ceil(left_s / 60)));
    }
    std::string names;
    for (size_t i : in_work_) names += (names.empty() ? "" : " ") + crowns_[i].row.id;
    if (names.size() > 60) names = names.substr(0, 57) + "...";
    progress_.Show("fitting", static_cast<double>(done) / static_cast<double>(std::max<size_t>(1, to_do_)),
                   detail + "; in progress: " + names);
  }

  const BatchOptions& options_;
  const BatchFolder& folder_;
  std::vector<CrownOutcome>& crowns_;
  Progress& progress_;
  const SayNews& say_;
  ProcessPool pool_;
  int jobs_ = 1, threads_ = 1;
  std::deque<size_t> waiting_;
  std::set<size_t> in_work_;
  std::map<size_t, int> attempts_;
  std::map<size_t, double> begun_s_;
  size_t to_do_ = 0, fitted_ = 0, failed_ = 0;
  Clock::time_point begin_;
};

std::string BatchText(const BatchOptions& options) {
  return ToJsonText(JsonValue::Object{{"format", "crownfit-batch/1"},
                                      {"manifest", fs::absolute(options.manifest).string()},
                                      {"arguments", options.fit.defaults}});
}

std::vector<std::pair<std::string, std::string>> SummaryFiles(std::span<const CrownOutcome> crowns) {
  return {{"summary.csv", SummaryCsv(crowns)},
          {"statistics.csv", StatisticsCsv(StatisticsOf(crowns))},
          {"times.csv", TimesCsv(crowns)},
          {"summary.html", SummaryHtml(crowns)}};
}

Manifest GoodManifest(const BatchOptions& options) {
  Manifest manifest = ReadManifest(options.manifest, options.fit, options.shard);
  const std::string faults = manifest.AllFaults();
  if (!manifest.faults.empty() || (!faults.empty() && !options.keep_going))
    throw InputError(
        "", "", "the manifest has faults:\n" + faults,
        manifest.faults.empty() ? "Correct them, or fit only the other rows with --keep-going." : "Correct them.");
  return manifest;
}

}  // namespace

std::vector<BatchNews> CapturesCountedTwice(std::span<const CrownOutcome> crowns) {
  std::map<std::pair<std::string, fs::path>, std::string> first;
  std::vector<BatchNews> news;
  for (const CrownOutcome& crown : crowns) {
    const fs::path& named = crown.row.capture;
    std::error_code error;
    const fs::path file = fs::canonical(fs::is_directory(named, error) ? named / "capture.json" : named, error);
    if (error || crown.state == CrownState::kFaulty) continue;
    const auto [other, is_new] = first.try_emplace({crown.row.group, file}, crown.row.id);
    if (!is_new)
      news.push_back({crown.row.id, "has the same capture as " + other->second +
                                        ", so that statistics.csv counts it twice. Remove one of the two rows, or give "
                                        "them different groups."});
  }
  return news;
}

BatchOutcome RunBatch(const BatchOptions& options, Progress& progress, const SayNews& say) {
  Manifest manifest = GoodManifest(options);
  const Signals signals;
  const BatchFolder folder(options.output, options.shard);
  folder.Write("batch.json", BatchText(options));
  BatchOutcome outcome;
  outcome.crowns = Survey(std::move(manifest.rows), options.output, options.shard);
  if (!options.shard)
    for (const BatchNews& news : CapturesCountedTwice(outcome.crowns)) say(news);
  outcome.fitted_now = Fitting(options, folder, outcome.crowns, progress, say).Run();
  outcome.signal = g_signal;
  if (outcome.signal == 0 && !options.shard)
    for (const auto& [name, text] : SummaryFiles(outcome.crowns)) folder.Write(name, text);
  return outcome;
}

BatchOutcome StartBatchFolder(const BatchOptions& options) {
  Manifest manifest = GoodManifest(options);
  WriteIntoFolder(options.output, "batch.json", BatchText(options));
  return {Survey(std::move(manifest.rows), options.output, {}), 0, 0};
}

BatchOutcome CollectBatch(BatchOptions options) {
  const fs::path file = options.output / "batch.json";
  const JsonFile json(file);
  const JsonObject root = json.RootOfFormat("crownfit-batch/1", {"manifest", "arguments"});
  options.manifest = root.Require("manifest").String();
  options.keep_going = true;
  options.fit.defaults.clear();
  for (const JsonNode& argument : root.Require("arguments").Items()) options.fit.defaults.push_back(argument.String());
  BatchOutcome outcome;
  outcome.crowns = Survey(GoodManifest(options).rows, options.output, {});
  for (CrownOutcome& crown : outcome.crowns) {
    const fs::path failure = options.output / "failed" / (crown.row.id + ".json");
    if (crown.state != CrownState::kWaiting || !fs::is_regular_file(failure)) continue;
    crown.state = CrownState::kFailed;
    const JsonFile failed(failure);
    crown.reason = JsonObject(failed.root(), {"id", "reason", "stderr"}).Require("reason").String();
  }
  return outcome;
}

void WriteSummary(const fs::path& root, std::span<const CrownOutcome> crowns) {
  for (const auto& [name, text] : SummaryFiles(crowns)) WriteIntoFolder(root, name, text);
}

}  // namespace crownfit
