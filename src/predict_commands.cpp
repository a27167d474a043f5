#include <cmath>
#include <cstdio>

#include "base/text.h"
#include "commands.h"
#include "photo/image_io.h"
#include "predict_question.h"
#include "prediction_file.h"
#include "report/swatches.h"

namespace crownfit {
namespace {

std::string TextOf(const FlatFigure& figure) {
  const auto number = [](double v) {  // infinite: nothing up to the thickest that was tried
    return std::isnan(v) ? "none" : std::isinf(v) ? Printed(">%g", kThickest_mm) : Number(v, 4);
  };
  const std::string value = number(figure.value) + " " + figure.unit;
  return figure.stddev ? value + "  95 % [" + number(*figure.low95) + ", " + number(*figure.high95) + "]" : value;
}

/// What is left to JSON, so that a page holds the rest.
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

}  // namespace

int RunPredict(const CommandLine& line) {
  const FlatQuestion question = FlatQuestionOf(line, line.material);
  Progress progress(line.progress);
  const FlatPrediction prediction =
      PredictFlat(question, [&](double share) { progress.Show("drawing materials", share); });
  progress.Clear();
  if (!line.output.empty()) WriteImageFile(line.output, FigureOf(question, prediction));
  const std::vector<std::string> assumptions = AssumptionsOf(line, question);
  if (line.json) {
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
  for (const std::string& a : assumptions) std::fprintf(stderr, "note: %s\n", a.c_str());
  return 0;
}

}  // namespace crownfit
