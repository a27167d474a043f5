#include "cli/fit_options_line.h"

#include <algorithm>
#include <charconv>

#include "base/error.h"

namespace crownfit {

std::vector<CLI::Option*> AddFitOptions(CLI::App* fit, FitText& options) {
  return {
      AddModel(fit, options.fit.model, {Model::kAuto, Model::kShader, Model::kDiffusion, Model::kPath, Model::kLayered},
               "shader: seconds, for looks. path: goes on to the optimum of random walks, minutes.\n"
               "diffusion: to walks that end in diffusion in the crown's volume, about a minute.\n"
               "auto (default of fit): path where shader leaves patches off by more than 1.5 times the\n"
               "square of their noise, or moves a pose or a lamp by more than twice its stated error;\n"
               "back to shader where walks explain less. Default of batch: shader.\n"
               "layered: of captures that hold measurements of flat samples alone; their default."),
      fit->add_option(
             "--target-de00", options.fit.target_de00,
             "Choose --model and --walks before the fit: the cheapest whose pictures of this scene are, as far\n"
             "as can be foreseen, within so much CIEDE2000 of the truth. Looks at the scene by some walks first.")
          ->check(CLI::Range(0.001, 1e7)),
      fit->add_option("--budget-s", options.fit.budget_s,
                      "Choose --model and --walks before the fit: the most accurate that is estimated to take so\n"
                      "many seconds on two cores, by stored costs and not by the clock. With --target-de00: the\n"
                      "cheapest that keeps both.")
          ->check(CLI::Range(0.001, 1e7)),
      fit->add_option("--fix", options.fixes,
                      "NAME=VALUE or NAME=R,G,B: hold a parameter, such as dentine.absorption_per_mm=0.05.")
          ->take_all(),
      fit->add_option("--free", options.fit.overrides.free, "NAME: fit a parameter the capture holds fixed.")
          ->take_all(),
      fit->add_option(
             "--share", options.shares,
             "NAME=channels, NAME=power_law or NAME=none: fit one value, a power law of wavelength, or a value\n"
             "in each channel, whatever the capture says; `crownfit check` tells what that does.")
          ->take_all(),
      fit->add_option(
             "--leave-out", options.fit.leave_out,
             "A part of the scene that `crownfit check` lists, such as tile:black; unneeded: all that it finds\n"
             "not needed, together too. The fit is quicker by the seconds that check tells, less some to find out.")
          ->take_all(),
      fit->add_option(
             "--prior", options.fit.prior,
             "Material file (material.json of an earlier fit, or a class of materials) whose values and standard "
             "deviations are\nthe priors; what they carry is called `prior` in the result.")
          ->check(CLI::ExistingFile),
      fit->add_flag("--no-priors", options.no_priors, "Let the photographs alone decide."),
      fit->add_option("--seed", options.fit.seed, "Seed of random numbers (default 1); model shader uses none."),
      AddCollisions(fit, options.fit.collisions),
      fit->add_flag("--twelve-taps", options.fit.twelve_taps,
                    "Blur by the thesis's 1 + 12 taps in place of 49: faster, coarser."),
      fit->add_option(
             "--walks", options.walks,
             "Model path: walks per photograph of each last run (default 1250000); half as many, 1.4 times the noise.\n"
             "Model diffusion: a fifth of them.")
          ->check(CLI::Range(size_t{1000}, size_t{10000000000})),
      fit->add_option("--profiles", options.fit.profile_points,
                      "Likelihood profiles in the report, by so many fits to either side of each weak parameter\n"
                      "(default 2), or half as many pictures by walks; 0: parabolas, no time. Default of batch: 0.")
          ->check(CLI::Range(0, 50)),
      fit->add_option("--max-pixels", options.fit.max_pixels_per_photograph,
                      "Pixels per photograph that the fit uses (default 6000; long runs of model path twice as many).")
          ->check(CLI::Range(size_t{100}, size_t{100000000})),
  };
}

FitOptions FitOptionsOf(const FitText& text) {
  FitOptions fit = text.fit;
  fit.use_priors = !text.no_priors;
  if (fit.is_planned() && (fit.model != Model::kAuto || text.walks))
    throw InputError("", "--target-de00, --budget-s", "choose --model and --walks themselves",
                     "Leave those away, or say --model auto.");
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
    if (!good || (values.size() != 1 && values.size() != kChannels))
      throw InputError("", "--fix " + fix, "expected NAME=VALUE, or NAME=R,G,B with a number for each channel");
    const std::string name = fix.substr(0, equals);
    const auto& fixed = fit.overrides.fix;
    const auto& freed = fit.overrides.free;
    if (std::any_of(fixed.begin(), fixed.end(), [&](const auto& f) { return f.first == name; }) ||
        std::count(freed.begin(), freed.end(), name))
      throw InputError("", "--fix " + name, "what it is to be is said twice",
                       "Say it once, with --fix or with --free.");
    values.resize(kChannels, values.empty() ? 0.0 : values[0]);
    fit.overrides.fix.push_back({name, {values[0], values[1], values[2]}});
  }
  for (const auto& share : text.shares) {
    const size_t equals = std::min(share.find('='), share.size());
    const std::string name = share.substr(0, equals);
    const std::optional<Sharing> sharing = SharingOf(share.substr(std::min(equals + 1, share.size())));
    if (!sharing) throw InputError("", "--share " + share, "expected NAME=channels, NAME=power_law or NAME=none");
    FitOverrides& o = fit.overrides;
    const auto is_it = [&](const auto& other) { return other.first == name; };
    if (std::ranges::any_of(o.share, is_it)) throw InputError("", "--share " + name, "what it is to be is said twice");
    if (std::ranges::any_of(o.fix, is_it))
      throw InputError("", "--share " + name, "what is fixed is not fitted", "Leave away --fix, or --share.");
    o.share.emplace_back(name, *sharing);
  }
  return fit;
}

}  // namespace crownfit
