#include <cmath>
#include <cstdio>

#include "base/text.h"
#include "cli/lay_up_options.h"
#include "dental/predict_question.h"
#include "dental/prediction_file.h"
#include "dental/swatches.h"
#include "photo/image_io.h"

namespace crownfit {
namespace {

struct PredictCommand {
  std::filesystem::path material, output;  ///< output: a picture of swatches; empty: none
  LayUp lay_up;
  bool json = false;
  CommonOptions common;
};

std::string TextOf(const FlatFigure& figure) {
  const auto number = [](double v) {  // infinite: none up to the thickest that was tried
    return std::isnan(v) ? "none" : std::isinf(v) ? Printed(">%g", kThickest_mm) : Number(v, 4);
  };
  const std::string value = number(figure.value) + " " + figure.unit;
  return figure.stddev ? value + "  95 % [" + number(*figure.low95) + ", " + number(*figure.high95) + "]" : value;
}

/// Figures that only the JSON output has, so that the printed ones fit on a page.
bool IsForMachines(const FlatFigure& figure) {
  return figure.name.find(".linear_") != std::string::npos || figure.name.find(".srgb_") != std::string::npos;
}

Image FigureOf(const FlatQuestion& q, const FlatPrediction& p) {
  std::vector<Swatch> swatches;
  for (const FlatGroup& g : p.groups) {
    const auto colour = [&](const std::string& over) {
      return glm::dvec3(g[over + ".linear_R"].value, g[over + ".linear_G"].value, g[over + ".linear_B"].value);
    };
    double total = 0;
    for (const double mm : g.thickness_mm) total += mm;
    swatches.push_back(
        {colour("over_black"),
         colour("over_white"),
         colour("over_stump"),
         {Printed("%s%.2f mm", g.name == "design" ? "design " : "", total), Printed("TP00 %.1f", g["tp00"].value),
          Printed("CR %.2f", g["contrast_ratio"].value), Printed("stump: dE00 %.1f", g["stump_shows"].value)}});
  }
  return SwatchFigure(swatches, q.colour.LinearRgb(q.black), q.colour.LinearRgb(q.white), q.colour.LinearRgb(q.stump));
}

int RunPredict(const PredictCommand& asked) {
  LayUp lay_up = asked.lay_up;
  lay_up.threads = asked.common.threads;
  const FlatQuestion question = FlatQuestionOf(lay_up, asked.material);
  Progress progress(asked.common.progress);
  const FlatPrediction prediction =
      PredictFlat(question, [&](double share) { progress.Show("drawing materials", share); });
  progress.Clear();
  if (!asked.output.empty()) WriteImageFile(asked.output, FigureOf(question, prediction));
  const std::vector<std::string> assumptions = AssumptionsOf(lay_up, question);
  if (asked.json) {
    std::fputs(ToJsonText(PredictionContent(question, prediction, assumptions)).c_str(), stdout);
    return 0;
  }
  for (const FlatGroup& group : prediction.groups) {
    for (size_t l = 0; l < group.thickness_mm.size(); ++l)
      std::printf("%s.thickness.%s %.4g mm\n", group.name.c_str(), question.material.material.layers[l].name.c_str(),
                  group.thickness_mm[l]);
    for (const FlatFigure& figure : group.figures)
      if (!IsForMachines(figure))
        std::printf("%s.%s %s\n", group.name.c_str(), figure.name.c_str(), TextOf(figure).c_str());
  }
  PrintNotes(assumptions);
  return 0;
}

}  // namespace

void AddPredict(CLI::App& app, Command& command) {
  const auto asked = std::make_shared<PredictCommand>();
  auto* predict = app.add_subcommand(
      "predict", "Predicts colour and translucency of a material at any thickness and over any stump.");
  predict->footer(
      "Prints for the design thickness and for 0.5, 1, 1.5 and 2 mm, with 95 % intervals: L*a*b* over black, white and "
      "the\n"
      "stump, TP00, TP, contrast ratio, masking thickness, reflectance, transmittance, and Kubelka-Munk's K and S.\n"
      "docs/dental.md explains each.\n\n"
      "Example:\n"
      "  crownfit predict result/material.json --thickness enamel=0.5,dentine=1 --stump 60,2,18 -o swatches.png");
  predict->add_option("MATERIAL", asked->material, "material.json of a fit, or truth.json.")->required();
  AddLayUp(predict, asked->lay_up);
  AddDraws(predict, asked->lay_up);
  AddTargets(predict, asked->lay_up);
  predict->add_option("--tabs", asked->lay_up.tabs, "Set of tabs from `crownfit shades`, for tab:NAME.");
  predict->add_option("-o,--output", asked->output, "PNG with the colours as swatches.");
  predict->add_flag("--json", asked->json, "Print the prediction as JSON.");
  AddCommonOptions(predict, asked->common);
  RunWith(predict, command, asked, RunPredict);
}

}  // namespace crownfit
