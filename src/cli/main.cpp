// crownfit <command>: parses the command line, runs the command, and reports errors.

#include <cstdio>
#include <exception>
#include <new>

#include "base/error.h"
#include "cli/command_line.h"

int main(int argc, char** argv) {
  try {
    return crownfit::ParseCommandLine(argc, argv).run();
  } catch (const crownfit::InputError& e) {
    std::fprintf(stderr, "crownfit: %s\n", e.what());
    return 2;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr,
                 "crownfit: there is not enough memory for this input\n"
                 "  Use smaller photographs, calibrated at their size, or a smaller mesh; docs/limits.md says how much "
                 "memory each needs.\n");
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "crownfit: internal error: %s\n", e.what());
    return 4;
  }
}
