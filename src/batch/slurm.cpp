#include "batch/slurm.h"

#include <sys/wait.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <sstream>

#include "base/error.h"
#include "base/json_file.h"

namespace crownfit {
namespace {

namespace fs = std::filesystem;

std::string Quoted(const std::string& word) {
  std::string quoted = "'";
  for (char c : word) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string Quoted(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + Quoted(word);
  return line;
}

struct Answer {
  int exit_code = -1;
  std::string text;  ///< standard output and error
};

Answer Ask(const std::vector<std::string>& command) {
  Answer answer;
  std::FILE* pipe = popen((Quoted(command) + " 2>&1").c_str(), "r");
  if (!pipe) return answer;
  char buffer[4096];
  for (size_t n; (n = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;) answer.text.append(buffer, n);
  const int status = pclose(pipe);
  if (WIFEXITED(status)) answer.exit_code = WEXITSTATUS(status);
  while (!answer.text.empty() && answer.text.back() == '\n') answer.text.pop_back();
  return answer;
}

/// The jobs submitted for a folder, newest last, and their number of shards.
struct Submitted {
  std::vector<std::string> jobs;
  size_t shards = 0;
};

fs::path JobsFile(const fs::path& root) { return root / "slurm" / "jobs.json"; }

Submitted ReadSubmitted(const fs::path& root) {
  Submitted submitted;
  if (!fs::is_regular_file(JobsFile(root))) return submitted;
  const JsonFile json(JobsFile(root));
  const JsonObject object = json.RootOfFormat("crownfit-slurm/1", {"jobs", "shards"});
  for (const JsonNode& job : object.Require("jobs").Items()) submitted.jobs.push_back(job.String());
  submitted.shards = static_cast<size_t>(object.Require("shards").Integer(1, 100000000));
  return submitted;
}

struct QueuedTask {
  size_t shard;
  std::string state;
};

std::vector<QueuedTask> TasksInQueue(const Submitted& submitted) {
  std::vector<QueuedTask> tasks;
  for (const std::string& job : submitted.jobs) {
    const Answer answer = Ask({"squeue", "-h", "-r", "-j", job, "-o", "%K %T"});
    if (answer.exit_code != 0) continue;  // Slurm has forgotten the job: it is over
    std::istringstream lines(answer.text);
    QueuedTask task;
    while (lines >> task.shard >> task.state) tasks.push_back(task);
  }
  return tasks;
}

/// "1-3,7"
std::string Ranges(const std::vector<size_t>& sorted) {
  std::string text;
  for (size_t i = 0; i < sorted.size();) {
    size_t end = i;
    while (end + 1 < sorted.size() && sorted[end + 1] == sorted[end] + 1) ++end;
    text += (text.empty() ? "" : ",") + std::to_string(sorted[i]) + (end > i ? "-" + std::to_string(sorted[end]) : "");
    i = end + 1;
  }
  return text;
}

/// The largest array index that the cluster allows.
size_t MostTasks() {
  const Answer answer = Ask({"scontrol", "show", "config"});
  const size_t at = answer.text.find("MaxArraySize");
  if (answer.exit_code != 0 || at == std::string::npos) return 1000;
  return std::max<size_t>(2, std::stoul(answer.text.substr(answer.text.find('=', at) + 1))) - 1;
}

/// Crowns per task, so that Slurm's overhead stays below a twentieth of their time.
size_t ChunkFor(std::span<const CrownOutcome> crowns) {
  constexpr double kScheduling_s = 0.42;  // per task, measured with Slurm 22.05
  constexpr double kUsual_s = 20;         // per crown, while none is finished
  double seconds = 0, count = 0;
  for (const CrownOutcome& crown : crowns)
    if (crown.record) {
      seconds += crown.record->wall_s;
      ++count;
    }
  const double each_s = count > 0 ? std::max(seconds / count, 0.01) : kUsual_s;
  return static_cast<size_t>(std::ceil(kScheduling_s / (0.05 * each_s)));
}

std::string ArrayScript(const BatchOptions& options, size_t shards) {
  std::vector<std::string> command{options.self.string(),
                                   "batch",
                                   fs::absolute(options.manifest).string(),
                                   "-o",
                                   fs::absolute(options.output).string(),
                                   "--program",
                                   options.program.string(),
                                   "--jobs",
                                   std::to_string(std::max(1, options.jobs)),
                                   "--threads",
                                   std::to_string(std::max(1, options.threads)),
                                   "--time-limit",
                                   std::to_string(options.limits.seconds),
                                   "--retries",
                                   std::to_string(options.retries),
                                   "--keep-going",
                                   "--progress",
                                   "none"};
  if (options.limits.memory_MiB > 0)
    command.insert(command.end(), {"--memory-limit", std::to_string(options.limits.memory_MiB)});
  command.insert(command.end(), options.fit.defaults.begin(), options.fit.defaults.end());
  return "#!/bin/sh\n"
         "# One task of the array: its share of the crowns. Written by crownfit batch --slurm.\n"
         "# If it is stopped early (time limit, preemption), it requeues itself and continues where it was.\n" +
         Quoted(command) + " --shard \"$SLURM_ARRAY_TASK_ID/" + std::to_string(shards) +
         "\" &\n"
         "fits=$!\n"
         "trap 'kill -TERM \"$fits\" 2>/dev/null' TERM\n"
         "wait \"$fits\"; code=$?\n"
         "while kill -0 \"$fits\" 2>/dev/null; do wait \"$fits\"; code=$?; done\n"
         "if [ \"$code\" -eq 75 ] && [ \"$(squeue -h -j \"$SLURM_JOB_ID\" -o %T)\" = RUNNING ]; then\n"
         "  scontrol requeue \"$SLURM_JOB_ID\"\n"
         "fi\n"
         "exit \"$code\"\n";
}

}  // namespace

SlurmSubmission SubmitBatch(const BatchOptions& options, const SlurmOptions& slurm) {
  if (Ask({"sbatch", "--version"}).exit_code != 0)
    throw InputError("", "--slurm", "sbatch was not found on this machine",
                     "Run the command where jobs are submitted, or divide the work with --shard i/n.");
  const BatchOutcome state = StartBatchFolder(options);
  Submitted submitted = ReadSubmitted(options.output);
  const std::vector<QueuedTask> queued = TasksInQueue(submitted);
  const size_t rows = state.crowns.size(), most = MostTasks();
  if (queued.empty() || submitted.shards == 0) {  // otherwise the shards of queued tasks must stay as they are
    const size_t chunk = slurm.chunk > 0 ? slurm.chunk : std::max((rows + most - 1) / most, ChunkFor(state.crowns));
    submitted.shards = (rows + chunk - 1) / chunk;
  }
  if (submitted.shards > most)
    throw InputError("", "--chunk",
                     std::to_string(submitted.shards) + " tasks are more than this cluster accepts in an array (" +
                         std::to_string(most) + ")",
                     "Give each task more crowns.");
  SlurmSubmission submission;
  submission.in_queue = queued.size();
  std::vector<size_t> to_submit;
  for (size_t s = 1; s <= submitted.shards; ++s) {
    const Shard shard{s, submitted.shards};
    size_t unfinished = 0;
    for (size_t i = 0; i < rows; ++i) unfinished += shard.Has(i, rows) && state.crowns[i].state == CrownState::kWaiting;
    submission.unfinished += unfinished;
    const bool is_queued = std::any_of(queued.begin(), queued.end(), [&](const auto& t) { return t.shard == s; });
    if (unfinished > 0 && !is_queued) to_submit.push_back(s);
  }
  submission.tasks = to_submit.size();
  if (to_submit.empty()) return submission;
  WriteIntoFolder(options.output, "slurm/array.sh", ArrayScript(options, submitted.shards));
  const fs::path root = fs::absolute(options.output);
  std::vector<std::string> command{
      "sbatch",
      "--parsable",
      "--job-name=crownfit",
      "--array=" + Ranges(to_submit),
      "--cpus-per-task=" + std::to_string(std::max(1, options.jobs) * std::max(1, options.threads)),
      "--requeue",
      "--open-mode=append",
      "--signal=B:TERM@60",
      "--output=" + (root / "slurm" / "%A_%a.log").string()};
  command.insert(command.end(), slurm.sbatch.begin(), slurm.sbatch.end());
  command.push_back((root / "slurm" / "array.sh").string());
  const Answer answer = Ask(command);
  if (answer.exit_code != 0)
    throw InputError("", "--slurm", "sbatch refused: " + answer.text, "The command was: " + Quoted(command));
  submission.job = answer.text.substr(0, answer.text.find_first_of(";\n"));
  submitted.jobs.push_back(submission.job);
  WriteIntoFolder(options.output, "slurm/jobs.json",
                  ToJsonText(JsonValue::Object{{"format", "crownfit-slurm/1"},
                                               {"jobs", submitted.jobs},
                                               {"shards", static_cast<double>(submitted.shards)}}));
  return submission;
}

std::vector<std::pair<std::string, size_t>> QueueOf(const fs::path& root) {
  std::map<std::string, size_t> states;
  for (const QueuedTask& task : TasksInQueue(ReadSubmitted(root))) ++states[task.state];
  return {states.begin(), states.end()};
}

std::vector<std::string> CancelBatch(const fs::path& root) {
  std::vector<std::string> cancelled;
  for (const std::string& job : ReadSubmitted(root).jobs)
    if (Ask({"squeue", "-h", "-j", job}).text.find(job) != std::string::npos && Ask({"scancel", job}).exit_code == 0)
      cancelled.push_back(job);
  return cancelled;
}

}  // namespace crownfit
