#include <CLI/CLI.hpp>

#include "command_line.h"
#include "command_line_parts.h"

namespace crownfit {
namespace {

/// How a material is laid up and measured.
void AddLayUp(CLI::App* app, CommandLine& line) {
  PredictLine& p = line.predict;
  app->add_option("--thickness", p.thickness,
                  "mm: of everything (1.2; layers keep their proportions), or of each layer "
                  "(enamel=0.5,dentine=1). Default: the material's own.");
  app->add_option("--stump", p.stump,
                  "What lies under it: L,a,b as measured in air (D65, 2 degrees), rgb:R,G,B reflectances in the "
                  "camera's bands, tab:NAME of --tabs, black or white. Default: black.");
  app->add_option("--cement", p.cement,
                  "Between material and stump: clear (contact, default), air (a gap: not cemented), or the "
                  "material.json of a cement.");
  app->add_option("--cement-mm", p.cement_mm, "Thickness of a cement that has a material (default 0.05).")
      ->check(CLI::Range(0.001, 2.0));
  app->add_option(
         "--stump-ior", p.stump_ior,
         "Refractive index of the stump (default 1.54, dentine and die resins; 1: bare metal or paint, which has "
         "none; a clear cement over it has 1.54).")
      ->check(CLI::Range(1.0, 3.0));
  app->add_option("--geometry", p.geometry, "Of the measurement: 45/0 (as photographs; default), 0/45, d/8 (sphere).");
  app->add_option("--aperture", p.aperture_mm,
                  "mm: diameter of the spot that a contact instrument lights and sees. Default: all is lit, as in "
                  "photographs.")
      ->check(CLI::Range(0.5, 100.0));
  app->add_option("--colour", p.colour, "colour.json of the camera. Without it its bands are taken as linear sRGB.");
}

void AddDraws(CLI::App* app, CommandLine& line) {
  app->add_option("--draws", line.predict.draws, "Materials drawn for the intervals (default 400).")
      ->check(CLI::Range(40, 100000));
  app->add_option("--seed", line.fit.seed, "Seed of the draws (default 1).");
}

/// What it is compared with.
void AddTargets(CLI::App* app, CommandLine& line) {
  app->add_option("--target", line.predict.target,
                  "Over what the result is to look the same, written as --stump is: masking is measured against it "
                  "(default white).");
  app->add_option("--black", line.predict.black, "The black card, where it is not ideal; written as --stump is.");
  app->add_option("--white", line.predict.white, "The white card, where it is not ideal.");
}

}  // namespace

void AddReport(CLI::App& app, CommandLine& line) {
  auto* report = app.add_subcommand(
      "report",
      "Makes report.html of a result again, for a browser, without network: the verdict in plain words,\n"
      "photographs against predictions, colours by thirds of the crown, parameters with intervals, their\n"
      "correlation, convergence, the material as a flat piece, provenance. `crownfit fit` makes it too, over black.\n"
      "With any of the options below the flat piece is laid up anew. docs/report.md explains it.");
  report->add_option("RESULT", line.output, "Folder that `crownfit fit` wrote, wherever it was moved to.")->required();
  AddLayUp(report, line);
  AddTargets(report, line);
  report->add_option("--tabs", line.predict.tabs,
                     "Tabs (`crownfit shades`): the report names the three nearest; also those that tab:NAME names.");
  report->final_callback([report, &line] {
    for (const CLI::Option* option : report->get_options())
      line.predict.is_asked |= option->count() > 0 && !option->get_positional();
  });
  AddCommonOptions(report, line);
}

void AddPredict(CLI::App& app, CommandLine& line) {
  auto* predict = app.add_subcommand(
      "predict",
      "Colour and translucency of a fitted material at other thicknesses and over other things, with 95 % intervals:\n"
      "L*a*b* over black, white and a stump, TP00, TP, contrast ratio, masking thickness, reflectance, transmittance,\n"
      "Kubelka-Munk's K and S; at the design thickness and at 0.5, 1, 1.5 and 2 mm. docs/dental.md explains each.");
  predict->add_option("MATERIAL", line.material, "material.json or truth.json.")->required();
  AddLayUp(predict, line);
  AddDraws(predict, line);
  AddTargets(predict, line);
  predict->add_option("--tabs", line.predict.tabs, "Tabs (`crownfit shades`) that tab:NAME names.");
  predict->add_option("-o,--output", line.output, "PNG with the colours as swatches.");
  predict->add_flag("--json", line.json, "Print JSON.");
  AddCommonOptions(predict, line);
}

void AddShades(CLI::App& app, CommandLine& line) {
  auto* shades = app.add_subcommand("shades",
                                    "The laboratory's own shade tabs, from its instrument or its photographs, and the "
                                    "nearest of them to a material or a colour.");
  shades->require_subcommand(1);

  auto* measured = shades->add_subcommand("measured", "A set of tabs from a table of an instrument's readings.");
  measured
      ->add_option("TABLE", line.shades.input, "Rows: name, L*, a*, b*[, stddev] or [, three of them]; D65, 2 degrees.")
      ->required();
  auto* photographed = shades->add_subcommand("photographed", "A set of tabs from a photograph of them.");
  photographed->add_option("PHOTOGRAPH", line.shades.input, "Linear picture or camera RAW, taken as the crowns are.")
      ->required();
  photographed->add_option("--tab", line.shades.patches, "NAME=X,Y,WIDTH,HEIGHT in pixels, on the tab; repeat it.")
      ->required()
      ->allow_extra_args(false);
  photographed->add_option("--colour", line.predict.colour,
                           "colour.json of the camera (default: bands are linear sRGB).");
  photographed->add_option("--noise", line.calibrate.noise, "noise.json of the camera: black level and saturation.");
  photographed
      ->add_option(
          "--card", line.shades.card,
          "X,Y,WIDTH,HEIGHT of a white or grey card beside them: sets level and white. Default: white is 1, or "
          "the colour file's.")
      ->expected(4)
      ->delimiter(',');
  photographed->add_option("--card-reflectance", line.shades.card_reflectance, "Of the card (default 0.18).")
      ->check(CLI::Range(0.01, 1.0));
  for (auto* task : {measured, photographed}) {
    task->add_option("-o,--output", line.output, "The file to write (crownfit-shades/1).")->required();
    task->add_option("--note", line.shades.note, "How they were measured: instrument, geometry, date.");
  }

  auto* nearest = shades->add_subcommand(
      "nearest", "The three nearest tabs by CIEDE2000, each with a 95 % interval, and whether they can be told apart.");
  nearest->add_option("SAMPLE", line.shades.sample, "material.json, laid up as the options say; or a colour L,a,b.")
      ->required();
  nearest->add_option("--tabs", line.predict.tabs, "The set of tabs.")->required();
  nearest->add_option("--stddev", line.shades.stddev, "SL,SA,SB: standard deviations of a colour L,a,b.");
  AddLayUp(nearest, line);
  AddDraws(nearest, line);
  nearest->add_flag("--json", line.json, "Print JSON.");
  AddCommonOptions(nearest, line);
}

}  // namespace crownfit
