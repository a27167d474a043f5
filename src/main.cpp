// crownfit <command>: a table from command to function, and what becomes of errors.

#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <new>
#include <string>

#include "base/error.h"
#include "commands.h"

int main(int argc, char** argv) {
  const std::map<std::string, std::function<int(const crownfit::CommandLine&)>> commands{
      {"batch", crownfit::RunBatchCommand},    {"check", crownfit::RunCheck},
      {"compare", crownfit::RunCompare},       {"fit", crownfit::RunFit},
      {"render", crownfit::RunRender},         {"slab", crownfit::RunSlab},
      {"synthesize", crownfit::RunSynthesize}, {"view", crownfit::RunView},
      {"match", crownfit::RunMatch},           {"calibrate", crownfit::RunCalibrate},
      {"capture", crownfit::RunCaptureInit},   {"export", crownfit::RunExport},
      {"report", crownfit::RunReport},         {"predict", crownfit::RunPredict},
      {"shades", crownfit::RunShades},         {"benchmark", crownfit::RunBenchmark},
  };
  try {
    const crownfit::CommandLine line = crownfit::ParseCommandLine(argc, argv);
    return line.exit_code ? *line.exit_code : commands.at(line.command)(line);
  } catch (const crownfit::InputError& e) {
    std::fprintf(stderr, "crownfit: %s\n", e.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr,
                 "crownfit: there is not enough memory for this input\n  Cut the photographs to the crown, or reduce "
                 "the mesh: docs/limits.md says what each needs.\n");
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "crownfit: internal error: %s\n", e.what());
    return 4;
  }
}
