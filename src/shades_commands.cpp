#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "base/error.h"
#include "base/json_file.h"
#include "calibration/colour_file.h"
#include "commands.h"
#include "exchange/shades_file.h"
#include "nearest_tabs.h"
#include "photo/photograph.h"
#include "predict_question.h"

namespace crownfit {
namespace {

using Rectangle = std::array<int, 4>;  // x, y, width, height

Rectangle RectangleOf(const std::string& key, const std::vector<double>& v, const Image& image) {
  const Rectangle r{static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2]), static_cast<int>(v[3])};
  if (r[0] < 0 || r[1] < 0 || r[2] < 1 || r[3] < 1 || r[0] + r[2] > image.width || r[1] + r[3] > image.height)
    throw InputError("", key, "the rectangle leaves the picture",
                     "It is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                         " pixels; write X,Y,WIDTH,HEIGHT.");
  return r;
}

glm::dvec3 MeanOf(const Photograph& photo, const Rectangle& r, const std::string& key) {
  glm::dvec3 sum(0.0);
  for (int y = r[1]; y < r[1] + r[3]; ++y)
    for (int x = r[0]; x < r[0] + r[2]; ++x) {
      if (!photo.usable[static_cast<size_t>(y) * photo.linear.width + x])
        throw InputError("", key, "holds saturated pixels", "Expose less, or keep the rectangle clear of glare.");
      for (int c = 0; c < 3; ++c) sum[c] += photo.linear.at(x, y, c);
    }
  return sum / (1.0 * r[2] * r[3]);
}

constexpr int kBlock = 8;

/// Mean colour of a tab's patch, and how its blocks of pixels scatter about it: what a tab's own unevenness does.
ShadeTab TabOf(const std::string& name, const Photograph& photo, const Rectangle& r, const std::string& key,
               const std::function<glm::dvec3(const glm::dvec3&)>& rgb) {
  if (r[2] < 2 * kBlock || r[3] < 2 * kBlock)
    throw InputError("", key, "is smaller than 16 x 16 pixels", "A standard deviation needs several blocks of 8 x 8.");
  ShadeTab tab{name, LabFromLinearRgb(rgb(MeanOf(photo, r, key))), glm::dvec3(0.0)};
  int blocks = 0;
  for (int y = r[1]; y + kBlock <= r[1] + r[3]; y += kBlock)
    for (int x = r[0]; x + kBlock <= r[0] + r[2]; x += kBlock, ++blocks) {
      const glm::dvec3 off = LabFromLinearRgb(rgb(MeanOf(photo, {x, y, kBlock, kBlock}, key))) - tab.lab;
      tab.stddev += off * off;
    }
  tab.stddev = glm::sqrt(tab.stddev / (blocks - 1.0));
  return tab;
}

ShadeSet Photographed(const CommandLine& line) {
  const BandColour colour = line.predict.colour ? ReadBandColour(*line.predict.colour) : BandColour{};
  PhotographFiles files;
  files.image = line.shades.input;
  if (line.calibrate.noise) files.noise = ReadSensorNoise(*line.calibrate.noise);
  const Photograph photo = ReadPhotograph(files);
  if (photo.was_jpeg)
    std::fprintf(stderr, "warning: %s is a JPEG: its tone curve and white balance are unknown\n",
                 line.shades.input.c_str());
  glm::dvec3 white = colour.white_sensor;
  if (!line.shades.card.empty())
    white = MeanOf(photo, RectangleOf("--card", line.shades.card, photo.linear), "--card") /
            line.shades.card_reflectance.value_or(0.18);
  constexpr double kLeastWhite = 0.02;  // of full scale
  if (std::min({white.x, white.y, white.z}) < kLeastWhite)
    throw InputError("", "--card", "is too dark in the picture", "Expose the grey card to about 0.2 of full scale.");
  ShadeSet set;
  set.made_by = "photographed";
  for (const std::string& patch : line.shades.patches) {
    const std::string key = "--tab " + patch;
    const size_t equals = patch.rfind('=');
    Rectangle r{};
    int length = 0;
    if (equals == std::string::npos || equals == 0 ||
        std::sscanf(patch.c_str() + equals + 1, "%d,%d,%d,%d%n", &r[0], &r[1], &r[2], &r[3], &length) != 4 ||
        equals + 1 + length != patch.size())
      throw InputError("", key, "expected NAME=X,Y,WIDTH,HEIGHT");
    const std::string name = patch.substr(0, equals);
    for (const ShadeTab& tab : set.tabs)
      if (tab.name == name) throw InputError("", key, "there are two tabs of this name", "Give each its own.");
    RectangleOf(key, {1.0 * r[0], 1.0 * r[1], 1.0 * r[2], 1.0 * r[3]}, photo.linear);
    set.tabs.push_back(
        TabOf(name, photo, r, key, [&](const glm::dvec3& sensor) { return colour.LinearRgb(sensor / white); }));
  }
  set.inputs = {line.shades.input};
  if (line.predict.colour) set.inputs.push_back(*line.predict.colour);
  return set;
}

int WriteSet(const CommandLine& line, ShadeSet set) {
  set.note = line.shades.note;
  WriteShades(line.output, set);
  for (const ShadeTab& tab : set.tabs)
    std::printf("%s.lab %.2f %.2f %.2f 1  stddev %.2f %.2f %.2f\n", tab.name.c_str(), tab.lab.x, tab.lab.y, tab.lab.z,
                tab.stddev.x, tab.stddev.y, tab.stddev.z);
  std::printf("%s\n", line.output.c_str());
  return 0;
}

ColourSample SampleOf(const CommandLine& line) {
  const auto lab = ThreeNumbers(line.shades.sample);
  if (!lab) {
    if (!line.shades.stddev.empty())
      throw InputError("", "--stddev", "is for a colour L,a,b", "A material states its own standard deviations.");
    Progress progress(line.progress);
    FlatQuestion question = FlatQuestionOf(line, line.shades.sample);
    question.other_totals_mm.clear();
    const FlatPrediction p = PredictFlat(question, [&](double share) { progress.Show("drawing materials", share); });
    for (const std::string& a : AssumptionsOf(line, question)) std::fprintf(stderr, "note: %s\n", a.c_str());
    return {p.lab, p.lab_of_draws};
  }
  const auto stddev = line.shades.stddev.empty() ? glm::dvec3(0.0) : ThreeNumbers(line.shades.stddev);
  if (!stddev || std::min({stddev->x, stddev->y, stddev->z}) < 0)
    throw InputError("", "--stddev", "'" + line.shades.stddev + "' is not three standard deviations",
                     "Write SL,SA,SB.");
  if (!IsSurfaceColour(*lab))
    throw InputError("", "L,a,b", "'" + line.shades.sample + "' is no colour of a surface",
                     "Expected L* from 0 to 100, a* and b* from -128 to 128.");
  if (line.shades.stddev.empty()) std::fprintf(stderr, "note: no --stddev is given: the colour counts as exact\n");
  return ScatteredColour(*lab, *stddev, line.predict.draws, line.fit.seed);
}

int Nearest(const CommandLine& line) {
  const NearestTabs nearest =
      NearestTabsOf(SampleOf(line), ReadShades(*line.predict.tabs), line.predict.draws, line.fit.seed);
  if (line.json) {
    std::fputs(ToJsonText(NearestJson(nearest)).c_str(), stdout);
    return 0;
  }
  for (size_t i = 0; i < nearest.tabs.size(); ++i) {
    const NearTab& n = nearest.tabs[i];
    std::printf("nearest_%zu.%s %.2f dE00  95 %% [%.2f, %.2f]\n", i + 1, n.name.c_str(), n.de00, n.low95, n.high95);
  }
  for (const std::string& v : nearest.verdict) std::printf("%s\n", v.c_str());
  return 0;
}

}  // namespace

int RunShades(const CommandLine& line) {
  if (line.shades.task == "nearest") return Nearest(line);
  if (line.shades.task == "photographed") return WriteSet(line, Photographed(line));
  return WriteSet(line, {"measured", "", {line.shades.input}, ReadShadeTable(line.shades.input)});
}

}  // namespace crownfit
