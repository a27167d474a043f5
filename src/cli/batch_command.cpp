#include <algorithm>
#include <csignal>
#include <cstdio>
#include <map>
#include <optional>
#include <tuple>

#include "base/error.h"
#include "base/json_file.h"
#include "batch/slurm.h"
#include "cli/fit_command.h"
#include "cli/fit_options_line.h"

namespace crownfit {
namespace {

struct BatchCommand {
  BatchOptions batch;
  FitText text;  ///< for all crowns
  bool to_slurm = false;
  std::string partition, time, account;  ///< of Slurm
  SlurmOptions slurm;
  std::string shard;  ///< i/n; empty: all
  CommonOptions common;
  std::string program;  ///< as it was called
};

/// The batch's settings for `fit`, and the user's options for all crowns.
BatchOptions BatchOf(const BatchCommand& asked, const std::vector<CLI::Option*>& fit_options) {
  BatchOptions options = asked.batch;
  options.threads = asked.common.threads;
  const bool is_planned = FitOptionsOf(asked.text).is_planned();
  std::error_code error;
  options.self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) options.self = asked.program;
  if (options.program.empty()) options.program = options.self;
  options.fit.fault = FaultOfFit;
  for (const CLI::Option* said : fit_options) {
    const std::string dashed = said->get_name();
    const bool is_flag = said->get_items_expected_max() == 0;
    options.fit.columns.push_back(
        {dashed.substr(2), is_flag, said->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll});
    if (dashed == "--model" && said->count() == 0 && !is_planned)
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "shader"});
    if (dashed == "--profiles" && said->count() == 0)
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "0"});
    if (said->count() == 0) continue;
    if (is_flag) options.fit.defaults.push_back(dashed);
    for (std::string value : said->results()) {
      // The path is made absolute: status, summary and cluster nodes may use another working directory.
      if (dashed == "--prior") value = std::filesystem::absolute(value).lexically_normal().string();
      if (!is_flag) options.fit.defaults.insert(options.fit.defaults.end(), {dashed, value});
    }
  }
  return options;
}

std::optional<Shard> ShardOf(const std::string& text) {
  if (text.empty()) return std::nullopt;
  Shard shard;
  int length = 0;
  if (std::sscanf(text.c_str(), "%zu/%zu%n", &shard.number, &shard.count, &length) != 2 ||
      static_cast<size_t>(length) != text.size() || shard.number < 1 || shard.number > shard.count)
    throw InputError("", "--shard " + text, "expected i/n with 1 <= i <= n, such as 3/10");
  return shard;
}

std::optional<SlurmOptions> SlurmOf(const BatchCommand& asked) {
  if (!asked.to_slurm) return std::nullopt;
  SlurmOptions slurm = asked.slurm;
  for (const auto& [option, value] :
       {std::pair{"--partition=", asked.partition}, {"--time=", asked.time}, {"--account=", asked.account}})
    if (!value.empty()) slurm.sbatch.push_back(option + value);
  return slurm;
}

void Print(const BatchNews& news, bool as_json) {
  if (!as_json) {
    std::fprintf(stderr, "%s: %s\n", news.id.c_str(), news.what.c_str());
    return;
  }
  std::string line = ToJsonText(JsonValue::Object{{"crown", news.id}, {"news", news.what}});
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::fprintf(stderr, "%s\n", line.c_str());
}

/// Prints the outcome of a batch on stdout; returns the exit code.
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
  for (const BatchNews& news : CapturesCountedTwice(outcome.crowns)) Print(news, false);
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

int Cancel(const BatchOptions& batch) {
  const std::filesystem::path& folder = batch.output;
  const std::vector<std::string> jobs = CancelBatch(folder);
  for (const std::string& job : jobs) std::printf("cancelled: job %s\n", job.c_str());
  if (jobs.empty()) std::printf("no task of %s is in Slurm's queue\n", folder.c_str());
  return 0;
}

int SubmitToSlurm(const BatchOptions& batch, const SlurmOptions& slurm) {
  const SlurmSubmission s = SubmitBatch(batch, slurm);
  if (s.in_queue > 0) std::printf("%zu tasks are still in the queue\n", s.in_queue);
  if (s.tasks > 0)
    std::printf("job %s: %zu tasks submitted for %zu unfinished crowns\n", s.job.c_str(), s.tasks, s.unfinished);
  if (s.unfinished == 0) return Collect(batch);
  std::printf("To see its progress: crownfit batch status %s\n", batch.output.c_str());
  return 0;
}

int FitHere(const BatchOptions& batch, ProgressMode mode) {
  Progress progress(mode);
  const bool as_json = mode == ProgressMode::kJson;
  const BatchOutcome outcome = RunBatch(batch, progress, [&](const BatchNews& news) { Print(news, as_json); });
  progress.Clear();
  if (outcome.signal != 0) {
    std::fprintf(stderr, "crownfit: stopped by signal %d. Run the same command to continue.\n", outcome.signal);
    return outcome.signal == SIGTERM ? 75 : 3;
  }
  if (batch.shard) return 0;  // `batch collect` decides the exit code
  return PrintOutcome(outcome, batch.output);
}

}  // namespace

void AddBatch(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<BatchCommand>();
  asked->program = command.program;
  auto* batch = app.add_subcommand("batch",
                                   "Fits every crown of a manifest, several at a time, each in its own process.\n"
                                   "Writes summary.csv, summary.html and statistics.csv.");
  batch->footer(
      "After a stop or a crash, run the same command again: it skips finished crowns, and fits again those whose\n"
      "capture or options changed. docs/batch.md describes manifests, clusters and faults.\n\n"
      "Example:\n"
      "  crownfit batch crowns.csv -o results --jobs 4\n"
      "where crowns.csv is\n"
      "  id,capture,group,fix\n"
      "  1041,scans/1041,zirconia A2,\n"
      "  1042,scans/1042,zirconia A2,core.ior=2.1\n"
      "Open results/summary.html in a browser.");
  batch->add_option("MANIFEST", asked->batch.manifest,
                    "CSV with the columns id and capture. Further columns may be group and the options of\n"
                    "`crownfit fit`. JSON is read too.");
  batch->add_option("-o,--output", asked->batch.output, "Folder for the results; it is created if missing.");
  batch
      ->add_option("--jobs", asked->batch.jobs,
                   "Crowns fitted at a time; 0 (default): one per processor. They share the threads.")
      ->check(CLI::Range(0, 1024));
  batch->add_option("--time-limit", asked->batch.limits.seconds, "Seconds that one crown may take (default 3600).")
      ->check(CLI::PositiveNumber);
  batch
      ->add_option("--memory-limit", asked->batch.limits.memory_MiB,
                   "MiB of memory that one crown may take (default: no limit).")
      ->check(CLI::PositiveNumber);
  batch->add_option("--retries", asked->batch.retries, "How often a fit that crashed is tried again (default 1).")
      ->check(CLI::Range(0, 100));
  batch->add_flag("--keep-going", asked->batch.keep_going, "Fit the valid rows of a manifest that has faults.");
  batch->add_option("--program", asked->batch.program,
                    "Program to run instead of crownfit, with the same arguments: a wrapper such as nice, or a\n"
                    "container.");
  const std::vector<CLI::Option*> fit_options = AddFitOptions(batch, asked->text);
  AddCommonOptions(batch, asked->common);
  batch->add_option("--shard", asked->shard,
                    "i/n: fit only the i-th of n parts, while other processes fit theirs. `crownfit batch collect`\n"
                    "then writes the summary.");
  batch
      ->add_flag("--slurm", asked->to_slurm,
                 "Submit the crowns to Slurm as a job array and return. All nodes must see the folder.\n"
                 "The same command again submits what is still unfinished.")
      ->group("Slurm");
  batch
      ->add_option("--chunk", asked->slurm.chunk,
                   "Crowns per task (default: so many that scheduling takes under 5 % of the time).")
      ->check(CLI::Range(size_t{1}, size_t{1000000}))
      ->group("Slurm");
  batch->add_option("-p,--partition", asked->partition, "Slurm partition, passed on to sbatch.")->group("Slurm");
  batch->add_option("-t,--time", asked->time, "Time limit of a task, passed on to sbatch.")->group("Slurm");
  batch->add_option("-A,--account", asked->account, "Account, passed on to sbatch.")->group("Slurm");
  batch
      ->add_option("--sbatch", asked->slurm.sbatch,
                   "A further argument of sbatch, such as --sbatch=--mem=2G. Repeatable.")
      ->take_all()
      ->group("Slurm");
  batch->require_subcommand(0, 1);
  batch->final_callback([=, &command] {
    if (!batch->get_subcommands().empty()) return;
    if (asked->batch.manifest.empty() || asked->batch.output.empty())
      throw InputError("", "batch", "expected MANIFEST -o DIR; or status, collect or cancel with DIR",
                       "See crownfit batch --help.");
    BatchOptions options = BatchOf(*asked, fit_options);
    options.shard = ShardOf(asked->shard);
    const std::optional<SlurmOptions> slurm = SlurmOf(*asked);
    const ProgressMode mode = asked->common.progress;
    command.run = [=] { return slurm ? SubmitToSlurm(options, *slurm) : FitHere(options, mode); };
  });
  const std::tuple<const char*, const char*, int (*)(const BatchOptions&)> tasks[] = {
      {"status", "Prints how many crowns of a batch are finished, failed, waiting or queued.", PrintStatus},
      {"collect", "Writes the summary of the finished crowns.", Collect},
      {"cancel", "Removes a batch's tasks from Slurm's queue. Finished crowns stay.", Cancel}};
  for (const auto& [name, what, run] : tasks) {
    auto* task = batch->add_subcommand(name, what);
    task->footer(std::string("Example:\n  crownfit batch ") + name + " results");
    task->add_option("DIR", asked->batch.output, "Folder of the batch.")->required();
    task->final_callback([=, &command, run = run] {
      command.run = [=, options = BatchOf(*asked, fit_options)] { return run(options); };
    });
  }
}

}  // namespace crownfit
