#include "batch_command_line.h"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "command_line.h"
#include "command_line_parts.h"
#include "fit_command_line.h"

namespace crownfit {
namespace {

/// What the batch must know of `fit`, and what the user said for all crowns.
BatchOptions BatchOf(const CommandLine& line, const std::string& program, const std::vector<CLI::Option*>& fit_options,
                     const CLI::App* batch) {
  BatchOptions options = line.batch;
  options.threads = line.fit.threads;
  std::error_code error;
  options.self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (error) options.self = program;
  if (options.program.empty()) options.program = options.self;
  options.fit.fault = FaultOfFit;
  for (const CLI::Option* option : fit_options) {
    const std::string dashed = option->get_name();
    const bool is_flag = option->get_items_expected_max() == 0;
    options.fit.columns.push_back(
        {dashed.substr(2), is_flag, option->get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll});
    const CLI::Option* said = batch->get_option(dashed);
    if (dashed == "--model" && said->count() == 0 && !line.fit.is_planned())
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "shader"});
    if (dashed == "--profiles" && said->count() == 0)
      options.fit.defaults.insert(options.fit.defaults.end(), {dashed, "0"});
    if (said->count() == 0) continue;
    if (is_flag) options.fit.defaults.push_back(dashed);
    for (std::string value : said->results()) {
      // Its status, its summary and a cluster's nodes may be asked for from another folder.
      if (dashed == "--prior") value = std::filesystem::absolute(value).lexically_normal().string();
      if (!is_flag) options.fit.defaults.insert(options.fit.defaults.end(), {dashed, value});
    }
  }
  return options;
}

}  // namespace

CLI::App* AddBatch(CLI::App& app, CommandLine& line, FitText& text, BatchWords& words) {
  auto* batch = app.add_subcommand(
      "batch",
      "Fits every crown of a manifest, several at a time, each in a process of its own; then writes summary.csv,\n"
      "summary.html and statistics.csv. Run the same command again to go on after a stop or a crash: what is\n"
      "finished is skipped, what changed is fitted again. docs/batch.md shows manifests, clusters, and what happens "
      "when.");
  batch->add_option(
      "MANIFEST", line.batch.manifest,
      "CSV with the columns id and capture, then any of group and the options of `crownfit fit`; or JSON.");
  batch->add_option("-o,--output", line.batch.output, "Folder for the results (made when missing).");
  batch
      ->add_option("--jobs", line.batch.jobs, "Crowns at a time; 0: one per processor. Threads are divided among them.")
      ->check(CLI::Range(0, 1024));
  batch->add_option("--time-limit", line.batch.limits.seconds, "Seconds a crown may take (default 3600).")
      ->check(CLI::PositiveNumber);
  batch
      ->add_option("--memory-limit", line.batch.limits.memory_MiB,
                   "MiB of memory a crown may take (default: no limit).")
      ->check(CLI::PositiveNumber);
  batch->add_option("--retries", line.batch.retries, "How often a crown that crashed is tried again (default 1).")
      ->check(CLI::Range(0, 100));
  batch->add_flag("--keep-going", line.batch.keep_going, "Fit the good rows of a manifest that has faults.");
  batch->add_option(
      "--program", line.batch.program,
      "What to run in place of this program, with the same arguments: a wrapper such as nice or a container.");
  AddFitOptions(batch, line, text);
  AddCommonOptions(batch, line);
  batch->add_option("--shard", words.shard,
                    "i/n: fit the i-th of n parts alone, beside others that fit theirs; `batch collect` sums up.");
  batch
      ->add_flag("--slurm", words.to_slurm,
                 "Submit the work to Slurm as an array over a folder that all nodes see, and return. The same command\n"
                 "again resubmits what died.")
      ->group("Slurm");
  batch->add_option("--chunk", words.slurm.chunk, "Crowns a task (default: so many that scheduling costs under 5 %).")
      ->check(CLI::Range(size_t{1}, size_t{1000000}))
      ->group("Slurm");
  batch->add_option("-p,--partition", words.partition, "As sbatch has it.")->group("Slurm");
  batch->add_option("-t,--time", words.time, "As sbatch has it.")->group("Slurm");
  batch->add_option("-A,--account", words.account, "As sbatch has it.")->group("Slurm");
  batch
      ->add_option("--sbatch", words.slurm.sbatch,
                   "Any further argument of sbatch, such as --sbatch=--mem=2G; repeat it.")
      ->take_all()
      ->group("Slurm");
  batch->require_subcommand(0, 1);
  const std::pair<const char*, const char*> tasks[] = {
      {"status", "How far a batch is, here or on the cluster."},
      {"collect", "Write the summary of what is finished."},
      {"cancel", "Take a batch's tasks from Slurm's queue; what is finished stays."}};
  for (const auto& [name, what] : tasks)
    batch->add_subcommand(name, what)->add_option("DIR", line.batch.output, "The batch's folder.")->required();
  return batch;
}

void TakeBatch(const CLI::App* batch, const std::vector<CLI::Option*>& fit_options, const std::string& program,
               const BatchWords& words, const std::function<void(const std::string&)>& complain, CommandLine& line) {
  if (!batch->parsed()) return;
  if (!batch->get_subcommands().empty()) line.batch_task = batch->get_subcommands().front()->get_name();
  if (line.batch_task.empty() && (line.batch.manifest.empty() || line.batch.output.empty()))
    complain("batch: expected MANIFEST -o DIR, or status, collect or cancel with DIR; see crownfit batch --help");
  line.batch = BatchOf(line, program, fit_options, batch);
  if (!words.shard.empty()) {
    Shard shard;
    int length = 0;
    if (std::sscanf(words.shard.c_str(), "%zu/%zu%n", &shard.number, &shard.count, &length) != 2 ||
        static_cast<size_t>(length) != words.shard.size() || shard.number < 1 || shard.number > shard.count)
      complain("--shard " + words.shard + ": expected i/n with 1 <= i <= n, such as 3/10");
    line.batch.shard = shard;
  }
  if (words.to_slurm) line.slurm = words.slurm;
  for (const auto& [option, value] :
       {std::pair{"--partition=", words.partition}, {"--time=", words.time}, {"--account=", words.account}})
    if (words.to_slurm && !value.empty()) line.slurm->sbatch.push_back(option + value);
}

}  // namespace crownfit
