#pragma once
// Many crowns on one machine, each fitted by a process of its own: never half-written, never lost, never twice.
//
//   DIR/crowns/ID/     a finished crown: what `crownfit fit` writes, and crown.json (batch/crown_record.h)
//   DIR/failed/ID.json why a crown has no result
//   DIR/summary.csv, summary.html, statistics.csv, times.csv
//   DIR/batch.json     manifest and options;  DIR/batch.lock, locks/  held while a batch works;  DIR/work/  being made

#include <functional>

#include "base/progress.h"
#include "batch/batch_folder.h"
#include "batch/process_pool.h"
#include "batch/summary.h"

namespace crownfit {

struct BatchOptions {
  std::filesystem::path manifest, output;
  FitCommand fit;
  std::filesystem::path self, program;  ///< this program; what to fit with in its place
  int jobs = 0;                         ///< processes at a time; 0: one per processor
  int threads = 0;                      ///< of each; 0: processors / jobs
  ProcessLimits limits;
  int retries = 1;             ///< after a crash
  bool keep_going = false;     ///< fits the good rows of a manifest with faults
  std::optional<Shard> shard;  ///< fits these alone, beside other shards, and writes no summary
};

struct BatchOutcome {
  std::vector<CrownOutcome> crowns;
  int signal = 0;         ///< that stopped the batch early
  size_t fitted_now = 0;  ///< others were finished before
};

/// What happened to a crown, in words for people.
struct BatchNews {
  std::string id, what;
};
using SayNews = std::function<void(const BatchNews&)>;

/// Fits what is not finished and writes the summary. `say`: as things happen. Throws InputError when
/// the manifest has faults, another batch works in the folder, or the folder can't be written.
BatchOutcome RunBatch(const BatchOptions& options, Progress& progress, const SayNews& say);

/// Makes the folder and its batch.json, as RunBatch does, and says what is finished there; beside others.
BatchOutcome StartBatchFolder(const BatchOptions& options);

/// What stands in options.output, whose batch.json says of which manifest; also while batches work there. Of `options`
/// the fit's command is read too.
BatchOutcome CollectBatch(BatchOptions options);
void WriteSummary(const std::filesystem::path& root, std::span<const CrownOutcome> crowns);

}  // namespace crownfit
