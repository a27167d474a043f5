#pragma once
// Options shared by several commands.

#include <CLI/CLI.hpp>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.h"
#include "cli/command.h"
#include "optics/model.h"

namespace crownfit {

struct CommonOptions {
  int threads = 0;  ///< 0: one per processor
  ProgressMode progress = ProgressMode::kAuto;
};

/// --threads and --progress.
void AddCommonOptions(CLI::App* app, CommonOptions& common);

/// --model, one of `known`.
CLI::Option* AddModel(CLI::App* app, Model& model, const std::vector<Model>& known, const std::string& help);

/// --collisions, for commands with model diffusion.
CLI::Option* AddCollisions(CLI::App* app, int& collisions);

/// Runs the command with these options once `app` was parsed.
template <class Options>
void RunWith(CLI::App* app, Command& command, const std::shared_ptr<Options>& options, int (*run)(const Options&)) {
  app->final_callback([=, &command] { command.run = [=] { return run(*options); }; });
}

/// Prints "note: ..." on stderr, a line each.
void PrintNotes(const std::vector<std::string>& notes);

/// --encoding, and --linear for its most frequent value. `encoding` must outlive the parsing.
void AddEncodingOptions(CLI::App* app, std::string& encoding);

}  // namespace crownfit
