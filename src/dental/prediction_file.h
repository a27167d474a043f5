#pragma once
// What a material looks like elsewhere, as JSON ("crownfit-prediction/1"): what `crownfit predict --json` prints, and
// what the report of a result shows.

#include "base/json_file.h"
#include "base/progress.h"
#include "dental/flat_prediction.h"
#include "dental/lay_up.h"

namespace crownfit {

/// With what was assumed, in words.
JsonValue::Object PredictionContent(const FlatQuestion& question, const FlatPrediction& prediction,
                                    std::vector<std::string> assumptions);

/// Writes prediction.json beside the material.json of a result, laid up as the options say, with the nearest of --tabs.
/// Without --colour colours are by the result's own colour.json, where it has one. Throws InputError.
void WritePrediction(LayUp lay_up, const std::filesystem::path& result, Progress& progress);

/// Writes in its place why there is none.
void WriteWhyNoPrediction(const std::filesystem::path& result, const std::string& why);

}  // namespace crownfit
