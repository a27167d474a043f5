#pragma once
// A batch as a Slurm job array, over a folder that all nodes see.

#include "batch/batch.h"

namespace crownfit {

struct SlurmOptions {
  size_t chunk =
      0;  ///< crowns per task; 0: enough that scheduling costs little and the array stays within the cluster's limit
  std::vector<std::string> sbatch;  ///< further arguments for sbatch
};

struct SlurmSubmission {
  std::string job;                 ///< empty when nothing was submitted
  size_t tasks = 0, in_queue = 0;  ///< submitted now; still queued or running from before
  size_t unfinished = 0;           ///< crowns
};

/// Writes DIR/slurm/array.sh and submits tasks for the shards that are neither finished nor queued. A second call
/// resubmits the shards that died. Throws InputError with sbatch's message.
SlurmSubmission SubmitBatch(const BatchOptions& options, const SlurmOptions& slurm);

/// Number of this folder's tasks in Slurm's queue, by state such as "RUNNING".
std::vector<std::pair<std::string, size_t>> QueueOf(const std::filesystem::path& root);
/// Returns the cancelled jobs.
std::vector<std::string> CancelBatch(const std::filesystem::path& root);

}  // namespace crownfit
