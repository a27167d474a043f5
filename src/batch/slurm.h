#pragma once
// A batch as an array of tasks under Slurm, over a folder that all nodes see.

#include "batch/batch.h"

namespace crownfit {

struct SlurmOptions {
  size_t chunk =
      0;  ///< crowns a task; 0: so many that scheduling costs little and the array stays within the cluster's limit
  std::vector<std::string> sbatch;  ///< further arguments of sbatch
};

struct SlurmSubmission {
  std::string job;                 ///< empty when there was nothing to submit
  size_t tasks = 0, in_queue = 0;  ///< submitted now; still queued or running from before
  size_t unfinished = 0;           ///< crowns
};

/// Writes DIR/slurm/array.sh and submits tasks for the shards that are not finished and not in the queue. A second call
/// resubmits what died. Throws InputError with sbatch's complaint.
SlurmSubmission SubmitBatch(const BatchOptions& options, const SlurmOptions& slurm);

/// Tasks of this folder's jobs in Slurm's queue, "RUNNING" -> number.
std::vector<std::pair<std::string, size_t>> QueueOf(const std::filesystem::path& root);
/// Returns the jobs that were cancelled.
std::vector<std::string> CancelBatch(const std::filesystem::path& root);

}  // namespace crownfit
