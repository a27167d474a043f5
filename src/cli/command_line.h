#pragma once
// What the user asked for.

#include <optional>

#include "cli/command.h"

namespace crownfit {

/// Parses. Where that has answered already (--help, --version, a wrong option), help and complaints are printed and
/// the command only returns the exit code.
Command ParseCommandLine(int argc, char** argv);

}  // namespace crownfit
