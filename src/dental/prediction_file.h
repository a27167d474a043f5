#pragma once
// Predictions of a material as a flat piece, as JSON ("crownfit-prediction/1"): printed by `crownfit predict --json`
// and shown in the report of a result.

#include "base/json_file.h"
#include "base/progress.h"
#include "dental/flat_prediction.h"
#include "dental/lay_up.h"

namespace crownfit {

/// Includes the assumptions, as sentences.
JsonValue::Object PredictionContent(const FlatQuestion& question, const FlatPrediction& prediction,
                                    std::vector<std::string> assumptions);

/// Writes prediction.json beside the material.json of a result, for the piece that the options describe, with the
/// nearest of --tabs. Without --colour, uses the result's own colour.json where it has one. Throws InputError.
void WritePrediction(LayUp lay_up, const std::filesystem::path& result, Progress& progress);

/// Writes the reason for a missing prediction in its place.
void WriteWhyNoPrediction(const std::filesystem::path& result, const std::string& why);

}  // namespace crownfit
