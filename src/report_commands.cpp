#include <cstdio>

#include "commands.h"
#include "report/report_files.h"

namespace crownfit {

int RunReport(const CommandLine& line) {
  std::printf("%s\n", WriteReportPage(line.output).c_str());
  return 0;
}

}  // namespace crownfit
