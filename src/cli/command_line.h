#pragma once
// The user's command line.

#include <optional>

#include "cli/command.h"

namespace crownfit {

/// Parses the command line. Where parsing is already the answer (--help, --version, a wrong option), it prints help or
/// the error, and the command only returns the exit code.
Command ParseCommandLine(int argc, char** argv);

}  // namespace crownfit
