#pragma once
// Options of `batch`.

#include <functional>
#include <string>
#include <vector>

#include "batch/slurm.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace crownfit {

struct CommandLine;
struct FitText;

/// Values of `batch` that need more than CLI11's types.
struct BatchWords {
  bool to_slurm = false;
  std::string partition, time, account, shard;
  SlurmOptions slurm;
};

CLI::App* AddBatch(CLI::App& app, CommandLine& line, FitText& text, BatchWords& words);

/// Takes over into `line` what was parsed, when it was `batch`. `fit_options` are those of `fit`; `program` is how this
/// one was called.
void TakeBatch(const CLI::App* batch, const std::vector<CLI::Option*>& fit_options, const std::string& program,
               const BatchWords& words, const std::function<void(const std::string&)>& complain, CommandLine& line);

}  // namespace crownfit
