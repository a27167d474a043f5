#include "cli/lay_up_options.h"

namespace crownfit {

void AddLayUp(CLI::App* app, LayUp& lay_up) {
  app->add_option("--thickness", lay_up.thickness,
                  "Thickness in mm, of all layers together (1.2; they keep their proportions) or of each\n"
                  "(enamel=0.5,dentine=1). Default: the thicknesses of the material.");
  app->add_option("--stump", lay_up.stump,
                  "What lies under the piece: L,a,b as measured in air (D65, 2 degrees); rgb:R,G,B reflectances\n"
                  "in the camera's bands; tab:NAME of --tabs; black or white. Default: black.");
  app->add_option("--cement", lay_up.cement,
                  "Between material and stump: clear (optical contact, default), air (a gap: not cemented), or\n"
                  "the material.json of a cement.");
  app->add_option("--cement-mm", lay_up.cement_mm,
                  "Thickness in mm of a cement given by a material.json (default 0.05).")
      ->check(CLI::Range(0.001, 2.0));
  app->add_option("--stump-ior", lay_up.stump_ior,
                  "Refractive index of the stump (default 1.54: dentine, die resins). 1: bare metal or paint,\n"
                  "which has no index; a clear cement over it has 1.54.")
      ->check(CLI::Range(1.0, 3.0));
  app->add_option("--geometry", lay_up.geometry,
                  "Geometry of the measurement: 45/0 (as photographs; default), 0/45, d/8 (sphere).");
  app->add_option("--aperture", lay_up.aperture_mm,
                  "Diameter in mm of the spot that a contact instrument lights and sees. Default: everything is\n"
                  "lit, as in photographs.")
      ->check(CLI::Range(0.5, 100.0));
  app->add_option("--colour", lay_up.colour,
                  "colour.json of the camera. Without it the camera's bands are taken as linear sRGB.");
}

void AddDraws(CLI::App* app, LayUp& lay_up) {
  app->add_option("--draws", lay_up.draws, "Number of materials drawn for the intervals (default 400).")
      ->check(CLI::Range(40, 100000));
  app->add_option("--seed", lay_up.seed, "Seed of the draws (default 1).");
}

void AddTargets(CLI::App* app, LayUp& lay_up) {
  app->add_option("--target", lay_up.target,
                  "Background that masking is measured against: over the stump, the piece should look as it does\n"
                  "over this one. Written like --stump (default: white).");
  app->add_option("--black", lay_up.black, "The black card, if it is not ideal; written like --stump.");
  app->add_option("--white", lay_up.white, "The white card, if it is not ideal; written like --stump.");
}

}  // namespace crownfit
