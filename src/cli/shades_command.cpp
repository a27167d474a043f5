#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>

#include "base/error.h"
#include "base/json_file.h"
#include "capture/colour_file.h"
#include "cli/lay_up_options.h"
#include "dental/nearest_tabs.h"
#include "dental/predict_question.h"
#include "dental/shades_file.h"
#include "photo/photograph.h"

namespace crownfit {
namespace {

/// A set of tabs to write.
struct TabSet {
  std::filesystem::path input, output;
  std::string note;
};

struct PhotographedTabs {
  TabSet set;
  std::vector<std::string> patches;  ///< NAME=X,Y,WIDTH,HEIGHT
  std::optional<std::filesystem::path> colour, noise;
  std::vector<double> card;  ///< x, y, width, height of a white or grey card
  std::optional<double> card_reflectance;
  std::string encoding = "file";
};

struct NearestCommand {
  std::string sample;  ///< material.json, or L,a,b
  std::string stddev;  ///< of L,a,b
  LayUp lay_up;
  bool json = false;
  CommonOptions common;
};

using Rectangle = std::array<int, 4>;  // x, y, width, height

Rectangle RectangleOf(const std::string& key, const std::vector<double>& v, const Image& image) {
  const Rectangle r{static_cast<int>(v[0]), static_cast<int>(v[1]), static_cast<int>(v[2]), static_cast<int>(v[3])};
  if (r[0] < 0 || r[1] < 0 || r[2] < 1 || r[3] < 1 || r[0] + r[2] > image.width || r[1] + r[3] > image.height)
    throw InputError("", key, "the rectangle reaches outside of the picture",
                     "The picture is " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                         " pixels; write X,Y,WIDTH,HEIGHT.");
  return r;
}

glm::dvec3 MeanOf(const Photograph& photo, const Rectangle& r, const std::string& key) {
  glm::dvec3 sum(0.0);
  for (int y = r[1]; y < r[1] + r[3]; ++y)
    for (int x = r[0]; x < r[0] + r[2]; ++x) {
      if (!photo.usable[static_cast<size_t>(y) * photo.linear.width + x])
        throw InputError("", key, "contains saturated pixels", "Expose less, or move the rectangle away from glare.");
      for (int c = 0; c < 3; ++c) sum[c] += photo.linear.at(x, y, c);
    }
  return sum / (1.0 * r[2] * r[3]);
}

constexpr int kBlock = 8;

/// Mean colour of a tab's patch, and the scatter of its blocks of pixels: the effect of the tab's own unevenness.
ShadeTab TabOf(const std::string& name, const Photograph& photo, const Rectangle& r, const std::string& key,
               const std::function<glm::dvec3(const glm::dvec3&)>& rgb) {
  if (r[2] < 2 * kBlock || r[3] < 2 * kBlock)
    throw InputError("", key, "is smaller than 16 x 16 pixels",
                     "The standard deviation is measured between blocks of 8 x 8 pixels: give a larger rectangle.");
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

ShadeSet Photographed(const PhotographedTabs& asked) {
  const BandColour colour = asked.colour ? ReadBandColour(*asked.colour) : BandColour{};
  PhotographFiles files;
  files.image = asked.set.input;
  files.encoding = Encoding::Named(asked.encoding, "--encoding");
  files.encoding_key = "--encoding";
  if (asked.noise) files.noise = ReadSensorNoise(*asked.noise);
  const Photograph photo = ReadPhotograph(files);
  if (photo.was_jpeg)
    std::fprintf(stderr, "warning: %s is a JPEG: its tone curve and white balance are unknown. Photograph in RAW.\n",
                 asked.set.input.c_str());
  glm::dvec3 white = VectorOf(colour.white_sensor);
  if (!asked.card.empty())
    white = MeanOf(photo, RectangleOf("--card", asked.card, photo.linear), "--card") /
            asked.card_reflectance.value_or(0.18);
  constexpr double kLeastWhite = 0.02;  // of full scale
  if (std::min({white.x, white.y, white.z}) < kLeastWhite)
    throw InputError("", "--card", "is too dark in the picture", "Expose the grey card to about 0.2 of full scale.");
  ShadeSet set;
  set.made_by = "photographed";
  for (const std::string& patch : asked.patches) {
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
      if (tab.name == name) throw InputError("", key, "two tabs have this name", "Give each tab a name of its own.");
    RectangleOf(key, {1.0 * r[0], 1.0 * r[1], 1.0 * r[2], 1.0 * r[3]}, photo.linear);
    set.tabs.push_back(
        TabOf(name, photo, r, key, [&](const glm::dvec3& sensor) { return colour.LinearRgb(sensor / white); }));
  }
  set.inputs = {asked.set.input};
  if (asked.colour) set.inputs.push_back(*asked.colour);
  return set;
}

int WriteSet(const TabSet& asked, ShadeSet set) {
  set.note = asked.note;
  WriteShades(asked.output, set);
  for (const ShadeTab& tab : set.tabs)
    std::printf("%s.lab %.2f %.2f %.2f 1  stddev %.2f %.2f %.2f\n", tab.name.c_str(), tab.lab.x, tab.lab.y, tab.lab.z,
                tab.stddev.x, tab.stddev.y, tab.stddev.z);
  std::printf("%s\n", asked.output.c_str());
  return 0;
}

ColourSample SampleOf(const NearestCommand& asked) {
  const auto lab = ThreeNumbers(asked.sample);
  if (!lab) {
    if (!asked.stddev.empty())
      throw InputError("", "--stddev", "is only for a colour L,a,b",
                       "Remove it: a material states its own standard deviations.");
    Progress progress(asked.common.progress);
    LayUp lay_up = asked.lay_up;
    lay_up.threads = asked.common.threads;
    FlatQuestion question = FlatQuestionOf(lay_up, asked.sample);
    question.other_totals_mm.clear();
    const FlatPrediction p = PredictFlat(question, [&](double share) { progress.Show("drawing materials", share); });
    PrintNotes(AssumptionsOf(lay_up, question));
    return {p.lab, p.lab_of_draws};
  }
  const auto stddev = asked.stddev.empty() ? glm::dvec3(0.0) : ThreeNumbers(asked.stddev);
  if (!stddev || std::min({stddev->x, stddev->y, stddev->z}) < 0)
    throw InputError("", "--stddev", "'" + asked.stddev + "' is not three standard deviations", "Write SL,SA,SB.");
  if (!IsSurfaceColour(*lab))
    throw InputError("", "L,a,b", "'" + asked.sample + "' is no colour of a surface",
                     "Expected L* from 0 to 100, a* and b* from -128 to 128.");
  if (asked.stddev.empty()) std::fprintf(stderr, "note: no --stddev is given, so the colour counts as exact\n");
  return ScatteredColour(*lab, *stddev, asked.lay_up.draws, asked.lay_up.seed);
}

int RunNearest(const NearestCommand& asked) {
  const NearestTabs nearest =
      NearestTabsOf(SampleOf(asked), ReadShades(*asked.lay_up.tabs), asked.lay_up.draws, asked.lay_up.seed);
  if (asked.json) {
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

int RunMeasured(const TabSet& asked) {
  return WriteSet(asked, {"measured", "", {asked.input}, ReadShadeTable(asked.input)});
}

int RunPhotographed(const PhotographedTabs& asked) { return WriteSet(asked.set, Photographed(asked)); }

void AddTabSet(CLI::App* task, TabSet& set) {
  task->add_option("-o,--output", set.output, "File to write (crownfit-shades/1).")->required();
  task->add_option("--note", set.note, "How the tabs were measured: instrument, geometry, date.");
}

}  // namespace

void AddShades(CLI::App& app, Command& command) {
  const auto table = std::make_shared<TabSet>();
  const auto tabs = std::make_shared<PhotographedTabs>();
  const auto nearest_asked = std::make_shared<NearestCommand>();
  auto* shades = app.add_subcommand(
      "shades", "Makes a set of your own shade tabs, and finds the tabs nearest to a material or a colour.");
  shades->require_subcommand(1);
  shades->footer(
      "Example:\n"
      "  crownfit shades measured tabs.csv -o tabs.json\n"
      "  crownfit shades nearest result/material.json --tabs tabs.json");

  auto* measured = shades->add_subcommand("measured", "Makes a set of tabs from a table of an instrument's readings.");
  measured->footer(
      "Example:\n"
      "  crownfit shades measured tabs.csv -o tabs.json --note \"spectrophotometer, 45/0, 3 March\"\n"
      "where tabs.csv is\n"
      "  name,L,a,b,stddev\n"
      "  A1,79.4,0.2,15.6,0.3\n"
      "  A2,76.1,1.4,19.0,0.3");
  measured
      ->add_option("TABLE", table->input,
                   "Table with rows of name, L*, a*, b* and, if known, one or three standard deviations; D65,\n"
                   "2 degrees.")
      ->required();
  auto* photographed = shades->add_subcommand("photographed", "Makes a set of tabs from a photograph of them.");
  photographed->footer(
      "Example:\n"
      "  crownfit shades photographed tabs.dng --tab A1=820,410,60,60 --tab A2=960,410,60,60 --colour colour.json \\\n"
      "    --card 300,400,80,80 -o tabs.json");
  photographed
      ->add_option("PHOTOGRAPH", tabs->set.input,
                   "Linear picture or camera RAW, taken like the photographs of the crowns.")
      ->required();
  photographed
      ->add_option("--tab", tabs->patches, "NAME=X,Y,WIDTH,HEIGHT in pixels: a rectangle on tab NAME. Repeatable.")
      ->required()
      ->allow_extra_args(false);
  photographed->add_option("--colour", tabs->colour,
                           "colour.json of the camera (default: the camera's bands are linear sRGB).");
  photographed->add_option("--noise", tabs->noise, "noise.json of the camera, for black level and saturation.");
  photographed
      ->add_option("--card", tabs->card,
                   "X,Y,WIDTH,HEIGHT in pixels on a white or grey card beside the tabs, which sets brightness and\n"
                   "white balance. Default: the white of the colour file, or else 1.")
      ->expected(4)
      ->delimiter(',');
  photographed->add_option("--card-reflectance", tabs->card_reflectance, "Reflectance of the card (default 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  AddEncodingOptions(photographed, tabs->encoding);
  AddTabSet(measured, *table);
  RunWith(measured, command, table, RunMeasured);
  AddTabSet(photographed, tabs->set);
  RunWith(photographed, command, tabs, RunPhotographed);

  auto* nearest = shades->add_subcommand(
      "nearest", "Finds the three nearest tabs by CIEDE2000, and says whether they can be told apart.");
  nearest->footer(
      "Example:\n"
      "  crownfit shades nearest result/material.json --tabs tabs.json --thickness 1.2 --stump 60,2,18\n"
      "Prints CIEDE2000 to each of the three tabs, with a 95 % interval.");
  nearest->add_option("SAMPLE", nearest_asked->sample, "material.json, laid up as the options say; or a colour L,a,b.")
      ->required();
  nearest
      ->add_option("--tabs", nearest_asked->lay_up.tabs,
                   "Set of tabs that `shades measured` or `shades photographed` made.")
      ->required();
  nearest->add_option("--stddev", nearest_asked->stddev,
                      "SL,SA,SB: standard deviations of a colour L,a,b (default: it is exact).");
  AddLayUp(nearest, nearest_asked->lay_up);
  AddDraws(nearest, nearest_asked->lay_up);
  nearest->add_flag("--json", nearest_asked->json, "Print the tabs as JSON.");
  AddCommonOptions(nearest, nearest_asked->common);
  RunWith(nearest, command, nearest_asked, RunNearest);
}

}  // namespace crownfit
