#include "dental/prediction_file.h"

#include "base/files.h"
#include "dental/nearest_tabs.h"
#include "dental/predict_question.h"
#include "dental/shades_file.h"

namespace crownfit {
namespace {

constexpr const char* kPredictionFormat = "crownfit-prediction/1";
constexpr int kDrawsOfPage = 100;  // takes a second or two; `predict` has --draws

JsonValue JsonOf(const FlatFigure& figure) {
  JsonValue::Object o{{"value", figure.value}, {"unit", figure.unit}};
  if (figure.stddev) {
    o.emplace_back("stddev", *figure.stddev);
    o.emplace_back("interval95", std::vector<double>{*figure.low95, *figure.high95});
  }
  return o;
}

void Write(const std::filesystem::path& result, const JsonValue::Object& content) {
  WriteTextFile(result / "prediction.json", ToJsonText(content));
}

}  // namespace

JsonValue::Object PredictionContent(const FlatQuestion& q, const FlatPrediction& p,
                                    std::vector<std::string> assumptions) {
  JsonValue::Array groups;
  for (const FlatGroup& g : p.groups) {
    JsonValue::Object thickness, figures;
    for (size_t l = 0; l < g.thickness_mm.size(); ++l)
      thickness.emplace_back(q.material.material.layers[l].name, g.thickness_mm[l]);
    for (const FlatFigure& f : g.figures) figures.emplace_back(f.name, JsonOf(f));
    groups.push_back(JsonValue::Object{{"name", g.name}, {"thickness_mm", thickness}, {"figures", figures}});
  }
  return {{"format", kPredictionFormat}, {"assumptions", std::move(assumptions)}, {"groups", groups}};
}

void WritePrediction(LayUp lay_up, const std::filesystem::path& result, Progress& progress) {
  const auto colour = result / "colour.json";
  if (!lay_up.colour && std::filesystem::exists(colour)) lay_up.colour = colour;
  FlatQuestion question = FlatQuestionOf(lay_up, result / "material.json");
  question.seed = 1;  // so that a page does not depend on the fit's own seed
  question.draws = kDrawsOfPage;
  const FlatPrediction prediction =
      PredictFlat(question, [&](double share) { progress.Show("drawing materials", share); });
  JsonValue::Object content = PredictionContent(question, prediction, AssumptionsOf(lay_up, question));
  if (lay_up.tabs)
    content.emplace_back("nearest_tabs", NearestJson(NearestTabsOf({prediction.lab, prediction.lab_of_draws},
                                                                   ReadShades(*lay_up.tabs), question.draws, 1)));
  Write(result, content);
}

void WriteWhyNoPrediction(const std::filesystem::path& result, const std::string& why) {
  Write(result, {{"format", kPredictionFormat}, {"missing", why}});
}

}  // namespace crownfit
