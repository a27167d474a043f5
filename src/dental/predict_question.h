#pragma once
// From how a material is laid up, in words, to what PredictFlat answers.

#include "dental/flat_prediction.h"
#include "dental/lay_up.h"

namespace crownfit {

/// Reads the material, cement, colour and tabs that the options name. Throws InputError.
FlatQuestion FlatQuestionOf(const LayUp& lay_up, const std::filesystem::path& material);

/// What was assumed, and what the intervals are, in words: a line each.
std::vector<std::string> AssumptionsOf(const LayUp& lay_up, const FlatQuestion& question);

}  // namespace crownfit
