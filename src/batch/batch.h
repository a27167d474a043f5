#pragma once
// Many crowns on one machine, each fitted by its own process. No result is half-written, lost or computed twice.
//
//   DIR/crowns/ID/     a finished crown: what `crownfit fit` writes, and crown.json (batch/crown_record.h)
//   DIR/failed/ID.json why a crown has no result
//   DIR/summary.csv, summary.html, statistics.csv, times.csv
//   DIR/batch.json     manifest and options;  DIR/batch.lock, locks/  held while a batch runs;  DIR/work/  unfinished

#include <functional>

#include "base/progress.h"
#include "batch/batch_folder.h"
#include "batch/process_pool.h"
#include "batch/summary.h"

namespace crownfit {

struct BatchOptions {
  std::filesystem::path manifest, output;
  FitCommand fit;
  std::filesystem::path self, program;  ///< this program; another one to run the fits
  int jobs = 0;                         ///< processes at a time; 0: one per processor
  int threads = 0;                      ///< per process; 0: processors / jobs
  ProcessLimits limits;
  int retries = 1;             ///< after a crash
  bool keep_going = false;     ///< fits the good rows of a manifest with faults
  std::optional<Shard> shard;  ///< fits only these crowns, beside other shards, and writes no summary
};

struct BatchOutcome {
  std::vector<CrownOutcome> crowns;
  int signal = 0;         ///< the signal that stopped the batch early
  size_t fitted_now = 0;  ///< by this run; others were finished before
};

/// An event of a crown, as text for people.
struct BatchNews {
  std::string id, what;
};
using SayNews = std::function<void(const BatchNews&)>;

/// Crowns whose capture is also an earlier crown's of the same group, also by symbolic links. Their options may differ,
/// so that both are fitted.
std::vector<BatchNews> CapturesCountedTwice(std::span<const CrownOutcome> crowns);

/// Fits the unfinished crowns and writes the summary; `say` reports events. Throws InputError when the manifest has
/// faults, another batch runs in the folder, or the folder can't be written.
BatchOutcome RunBatch(const BatchOptions& options, Progress& progress, const SayNews& say);

/// Creates the folder and its batch.json as RunBatch does, and reports what is finished there; may run beside others.
BatchOutcome StartBatchFolder(const BatchOptions& options);

/// Reads the results in options.output, also while batches run there; its batch.json names the manifest. Of the other
/// options, only the fit's command is used.
BatchOutcome CollectBatch(BatchOptions options);
void WriteSummary(const std::filesystem::path& root, std::span<const CrownOutcome> crowns);

}  // namespace crownfit
