#pragma once
// One function per command: read, run, write, print. Each returns the exit code.

#include "base/progress.h"
#include "command_line.h"
#include "report/result_files.h"

namespace crownfit {

int RunBatchCommand(const CommandLine& line);
int RunBenchmark(const CommandLine& line);
int RunCalibrate(const CommandLine& line);
int RunCaptureInit(const CommandLine& line);
int RunCaptureMeasured(const CommandLine& line);
int RunExport(const CommandLine& line);
int RunFit(const CommandLine& line);
/// What a fit leaves, and the page that shows it; with the material as a flat piece, laid up as the options say.
void WriteResultWithPage(const CommandLine& line, const std::filesystem::path& folder, const CrownFit& fit,
                         const RunRecord& run, Progress& progress);
int RunReport(const CommandLine& line);
int RunCheck(const CommandLine& line);
/// Says that a capture was written to `line.output`, and checks it.
int CheckWhatWasMade(const CommandLine& line);
int RunSlab(const CommandLine& line);
int RunSynthesize(const CommandLine& line);
int RunRender(const CommandLine& line);
int RunCompare(const CommandLine& line);
int RunView(const CommandLine& line);
int RunMatch(const CommandLine& line);
int RunPredict(const CommandLine& line);
int RunShades(const CommandLine& line);

}  // namespace crownfit
