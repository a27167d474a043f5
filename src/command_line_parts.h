#pragma once
// Parts of the command line that stand in files of their own.

namespace CLI {
class App;
}

namespace crownfit {

struct CommandLine;

/// --threads and --progress.
void AddCommonOptions(CLI::App* app, CommandLine& line);
void AddBenchmark(CLI::App& app, CommandLine& line);
void AddCalibrate(CLI::App& app, CommandLine& line);
void AddCapture(CLI::App& app, CommandLine& line);
/// A task of the command `capture`.
void AddCaptureMeasured(CLI::App& capture, CommandLine& line);
void AddExport(CLI::App& app, CommandLine& line);
void AddMatch(CLI::App& app, CommandLine& line);
void AddPredict(CLI::App& app, CommandLine& line);
void AddReport(CLI::App& app, CommandLine& line);
void AddShades(CLI::App& app, CommandLine& line);
void AddView(CLI::App& app, CommandLine& line);

}  // namespace crownfit
