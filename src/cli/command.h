#pragma once
// The commands of the program. Each adds its options to the parser; parsing stores the function to run.

#include <filesystem>
#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace crownfit {

/// The parsed command.
struct Command {
  std::string line;               ///< the whole command line, for run.json
  std::filesystem::path program;  ///< argv[0]
  std::function<int()> run;       ///< reads, runs, writes and prints; returns the exit code. Throws InputError.
};

/// Each adds one command; its file documents it and holds its options. `command` must outlive parsing.
void AddBatch(CLI::App& app, Command& command);
void AddBenchmark(CLI::App& app, Command& command);
void AddCalibrate(CLI::App& app, Command& command);
void AddCapture(CLI::App& app, Command& command);
void AddCheck(CLI::App& app, Command& command);
void AddCompare(CLI::App& app, Command& command);
void AddExport(CLI::App& app, Command& command);
void AddFit(CLI::App& app, Command& command);
void AddMatch(CLI::App& app, Command& command);
void AddPredict(CLI::App& app, Command& command);
void AddRender(CLI::App& app, Command& command);
void AddReport(CLI::App& app, Command& command);
void AddShades(CLI::App& app, Command& command);
void AddSlab(CLI::App& app, Command& command);
void AddSynthesize(CLI::App& app, Command& command);
void AddView(CLI::App& app, Command& command);

}  // namespace crownfit
