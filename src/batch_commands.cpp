#include <algorithm>
#include <csignal>
#include <cstdio>
#include <map>

#include "base/json_file.h"
#include "commands.h"

namespace crownfit {
namespace {

void Print(const BatchNews& news, bool as_json) {
  if (!as_json) {
    std::fprintf(stderr, "%s: %s\n", news.id.c_str(), news.what.c_str());
    return;
  }
  std::string line = ToJsonText(JsonValue::Object{{"crown", news.id}, {"news", news.what}});
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "%s\n", line.c_str());
}

/// What became of a batch, on stdout; the exit code.
int PrintOutcome(const BatchOutcome& outcome, const std::filesystem::path& folder) {
  std::map<std::string, std::string> ids;
  size_t usable = 0;
  for (const CrownOutcome& crown : outcome.crowns) {
    if (crown.usable()) ++usable;
    if (!crown.usable()) ids[StatusOf(crown)] += " " + crown.row.id;
  }
  std::printf("%zu crowns, %zu fitted now, %zu usable\n", outcome.crowns.size(), outcome.fitted_now, usable);
  for (const auto& [status, of_status] : ids) std::printf("%s:%s\n", status.c_str(), of_status.c_str());
  std::printf("\nLook at: %s\n", (folder / "summary.html").c_str());
  return usable == outcome.crowns.size() ? 0 : 1;
}

int Collect(const BatchOptions& batch) {
  const BatchOutcome outcome = CollectBatch(batch);
  WriteSummary(batch.output, outcome.crowns);
  return PrintOutcome(outcome, batch.output);
}

int PrintStatus(const BatchOptions& batch) {
  const BatchOutcome outcome = CollectBatch(batch);
  std::map<std::string, size_t> counts;
  for (const CrownOutcome& crown : outcome.crowns) ++counts[StatusOf(crown)];
  std::printf("%zu crowns", outcome.crowns.size());
  for (const auto& [status, count] : counts) std::printf(", %zu %s", count, status.c_str());
  std::printf("\n");
  for (const auto& [state, count] : QueueOf(batch.output))
    std::printf("in Slurm's queue: %zu tasks %s\n", count, state.c_str());
  return 0;
}

int Cancel(const std::filesystem::path& folder) {
  const std::vector<std::string> jobs = CancelBatch(folder);
  for (const std::string& job : jobs) std::printf("cancelled: job %s\n", job.c_str());
  if (jobs.empty()) std::printf("nothing of %s is in Slurm's queue\n", folder.c_str());
  return 0;
}

int SubmitToSlurm(const BatchOptions& batch, const SlurmOptions& slurm) {
  const SlurmSubmission s = SubmitBatch(batch, slurm);
  if (s.in_queue > 0) std::printf("%zu tasks are still in the queue\n", s.in_queue);
  if (s.tasks > 0)
    std::printf("job %s: %zu tasks submitted for %zu unfinished crowns\n", s.job.c_str(), s.tasks, s.unfinished);
  if (s.unfinished == 0) return Collect(batch);
  std::printf("How far it is: crownfit batch status %s\n", batch.output.c_str());
  return 0;
}

}  // namespace

int RunBatchCommand(const CommandLine& line) {
  if (line.batch_task == "status") return PrintStatus(line.batch);
  if (line.batch_task == "collect") return Collect(line.batch);
  if (line.batch_task == "cancel") return Cancel(line.batch.output);
  if (line.slurm) return SubmitToSlurm(line.batch, *line.slurm);
  Progress progress(line.progress);
  const bool as_json = line.progress == ProgressMode::kJson;
  const BatchOutcome outcome = RunBatch(line.batch, progress, [&](const BatchNews& news) { Print(news, as_json); });
  progress.Clear();
  if (outcome.signal != 0) {
    std::fprintf(stderr, "crownfit: stopped by signal %d. Run the same command to go on.\n", outcome.signal);
    return outcome.signal == SIGTERM ? 75 : 3;
  }
  if (line.batch.shard) return 0;  // `batch collect` judges
  return PrintOutcome(outcome, line.batch.output);
}

}  // namespace crownfit
