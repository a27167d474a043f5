#include "cli/fit_options_line.h"

#include <algorithm>
#include <charconv>

#include "base/error.h"

namespace crownfit {

std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, FitText& options) {
  return {
      AddModel(fit, options.fit.model, {Model::kAuto, Model::kShader, Model::kDiffusion, Model::kPath, Model::kLayered},
               "shader: takes the crown as flat below every point; seconds. Default of batch.\n"
               "path: continues from there to the path-traced optimum; minutes.\n"
               "diffusion: continues with random walks that switch to diffusion in the crown's volume; about\n"
               "a minute.\n"
               "auto: path if shader leaves patches off by more than 1.5 times the square of their noise,\n"
               "or moves a pose or lamp by more than twice its stated error. It returns to shader if path\n"
               "explains the photographs less well. Default of fit.\n"
               "layered: for captures of flat-sample measurements alone; their default."),
      fit->add_option("--target-de00", options.fit.target_de00,
                      "Choose --model and --walks before the fit: the cheapest choice whose pictures are estimated\n"
                      "to be within this CIEDE2000 of the truth. First renders the scene with a few random walks.")
          ->check(CLI::Range(0.001, 1e7)),
      fit->add_option("--budget-s", options.fit.budget_s,
                      "Choose --model and --walks before the fit: the most accurate choice that is estimated to\n"
                      "take at most this many seconds on two cores. The estimate uses stored costs, not the clock.\n"
                      "With --target-de00: the cheapest choice that keeps both.")
          ->check(CLI::Range(0.001, 1e7)),
      fit->add_option("--fix", options.fixes,
                      "NAME=VALUE or NAME=R,G,B: hold a parameter, such as dentine.absorption_per_mm=0.05.")
          ->take_all(),
      fit->add_option("--free", options.fit.overrides.free, "NAME: fit a parameter that the capture holds fixed.")
          ->take_all(),
      fit->add_option("--share", options.shares,
                      "NAME=channels, NAME=power_law or NAME=none: fit one value, a power law of wavelength, or a\n"
                      "value in each channel, whatever the capture says. `crownfit check` foresees the effect.")
          ->take_all(),
      fit->add_option("--leave-out", options.fit.leave_out,
                      "Leave out a part of the scene that `crownfit check` lists, such as tile:black.\n"
                      "unneeded: leave out all parts that are not needed, even together. The fit saves the seconds\n"
                      "that check prints, less those to find this out.")
          ->take_all(),
      fit->add_option("--prior", options.fit.prior,
                      "Take values and standard deviations of a material file as priors: material.json of an\n"
                      "earlier fit, or of a class of materials. What they hold has status `prior` in the result.")
          ->check(CLI::ExistingFile),
      fit->add_flag("--no-priors", options.no_priors, "Use no priors: the photographs alone decide."),
      fit->add_option("--seed", options.fit.seed, "Seed of the random numbers (default 1). Model shader uses none."),
      AddCollisions(fit, options.fit.collisions),
      fit->add_flag("--twelve-taps", options.fit.twelve_taps,
                    "Blur with the thesis's 1 + 12 taps instead of 49: faster, coarser."),
      fit->add_option("--walks", options.walks,
                      "Model path: random walks per photograph in all runs together (default 1250000). Half as many\n"
                      "give 1.4 times the noise.")
          ->check(CLI::Range(size_t{1000}, size_t{10000000000})),
      fit->add_option("--profiles", options.fit.profile_points,
                      "Likelihood profiles in the report: number of fits to either side of each weak parameter\n"
                      "(default 2, of batch 0). Models path and diffusion render half as many pictures instead.\n"
                      "0: parabolas, which take no time.")
          ->check(CLI::Range(0, 50)),
      fit->add_option("--max-pixels", options.fit.max_pixels_per_photograph,
                      "Pixels per photograph that the fit uses (default 6000). Final runs of model path use twice\n"
                      "as many.")
          ->check(CLI::Range(size_t{100}, size_t{100000000})),
  };
}

FitOptions FitOptionsOf(const FitText& text) {
  FitOptions fit = text.fit;
  fit.use_priors = !text.no_priors;
  if (fit.is_planned() && (fit.model != Model::kAuto || text.walks))
    throw InputError("", "--target-de00, --budget-s", "these options choose --model and --walks",
                     "Remove --model and --walks, or write --model auto.");
  if (text.walks) fit.paths_per_photograph = *text.walks;
  for (const auto& fix : text.fixes) {
    const size_t equals = fix.find('=');
    const char* end = fix.data() + fix.size();
    const char* next = equals == std::string::npos ? end : fix.data() + equals;
    std::vector<double> values;
    bool good = next != end;
    while (good && next != end) {
      values.push_back(0);
      const auto [stop, error] = std::from_chars(next + 1, end, values.back());
      good = error == std::errc() && (stop == end || *stop == ',');
      next = stop;
    }
    if (!good || values.empty())
      throw InputError("", "--fix " + fix, "expected NAME=VALUE, or NAME=R,G,B with a number for each channel");
    const std::string name = fix.substr(0, equals);
    const auto& fixed = fit.overrides.fix;
    const auto& freed = fit.overrides.free;
    if (std::any_of(fixed.begin(), fixed.end(), [&](const auto& f) { return f.first == name; }) ||
        std::count(freed.begin(), freed.end(), name))
      throw InputError("", "--fix " + name, "this parameter is stated twice",
                       "State it once, with --fix or with --free.");
    fit.overrides.fix.emplace_back(name, values);
  }
  for (const auto& share : text.shares) {
    const size_t equals = std::min(share.find('='), share.size());
    const std::string name = share.substr(0, equals);
    const std::optional<Sharing> sharing = SharingOf(share.substr(std::min(equals + 1, share.size())));
    if (!sharing) throw InputError("", "--share " + share, "expected NAME=channels, NAME=power_law or NAME=none");
    FitOverrides& o = fit.overrides;
    const auto is_it = [&](const auto& other) { return other.first == name; };
    if (std::ranges::any_of(o.share, is_it)) throw InputError("", "--share " + name, "this parameter is stated twice");
    if (std::ranges::any_of(o.fix, is_it))
      throw InputError("", "--share " + name, "a parameter that is fixed is not fitted", "Remove --fix or --share.");
    o.share.emplace_back(name, *sharing);
  }
  return fit;
}

}  // namespace crownfit
