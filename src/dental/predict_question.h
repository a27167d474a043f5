#pragma once
// Translates the options of a flat piece into a question for PredictFlat.

#include "dental/flat_prediction.h"
#include "dental/lay_up.h"

namespace crownfit {

/// Reads the material, cement, colour and tabs that the options name. Throws InputError.
FlatQuestion FlatQuestionOf(const LayUp& lay_up, const std::filesystem::path& material);

/// The assumptions and the meaning of the intervals, one line each.
std::vector<std::string> AssumptionsOf(const LayUp& lay_up, const FlatQuestion& question);

}  // namespace crownfit
