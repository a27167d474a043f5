#pragma once
// From what the command line says to what PredictFlat answers.

#include "command_line.h"
#include "flat_prediction.h"

namespace crownfit {

/// Reads the material, cement, colour and tabs that the options name. Throws InputError.
FlatQuestion FlatQuestionOf(const CommandLine& line, const std::filesystem::path& material);

/// What was assumed, and what the intervals are, in words: a line each.
std::vector<std::string> AssumptionsOf(const CommandLine& line, const FlatQuestion& question);

}  // namespace crownfit
