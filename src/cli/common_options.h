#pragma once
// Options that several commands have.

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

/// --collisions, of commands that have model diffusion.
CLI::Option* AddCollisions(CLI::App* app, int& collisions);

/// When `app` was parsed, the command is to run with these options.
template <class Options>
void RunWith(CLI::App* app, Command& command, const std::shared_ptr<Options>& options, int (*run)(const Options&)) {
  app->final_callback([=, &command] { command.run = [=] { return run(*options); }; });
}

/// "note: ..." on stderr, a line each.
void PrintNotes(const std::vector<std::string>& notes);

}  // namespace crownfit
