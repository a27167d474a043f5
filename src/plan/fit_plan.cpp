#include "plan/fit_plan.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/random.h"
#include "base/text.h"
#include "fit/choose_pixels.h"
#include "fit/fit_shader.h"
#include "path/path_derivatives.h"
#include "path/path_photograph.h"
#include "photo/colour_difference.h"
#include "plan/fit_seconds.h"
#include "plan/scene_requirements.h"
#include "plan/start_state.h"

namespace crownfit {
namespace {

constexpr uint64_t kLookStream = 0x6c6f6f6bull;  // neither a fit's walks nor a synthesis

std::string Seconds(double s) { return Printed(s < 1e6 ? "%.0f s" : "%.2g s", std::ceil(s)); }

std::string Words(const FitPlan& plan) {
  if (plan.model == Model::kShader) return "model shader";
  return "model path with " + std::to_string(plan.paths_per_photograph) + " walks per photograph";
}

/// How a scene at its start values looks by walks and by `shader`.
struct SceneLook {
  double shader_de00 = 0;  ///< shader against walks, the walks' own noise taken off; at most
  double noise_de00 = 0;   ///< of the walks: median over blocks
  double paths_per_block = 0;
};

/// One of four blocks of the pixels that colour differences are means of.
bool IsLookedAt(const PixelCast& pixel) {
  constexpr int kBlock = 8, kEvery = 4;
  return (pixel.x / kBlock + 2 * (pixel.y / kBlock)) % kEvery == 0;
}

/// Two independent halves of a walked photograph, and what shader shows, at the pixels of the fit that are looked at.
struct LookedAt {
  Image first, second, shader;
  std::vector<uint8_t> compared;
};

LookedAt Halves(const FitProblem& problem, const FitState& at, const FitPixels& p, const PathPhotograph& walked) {
  const int channels = problem.capture.channels();
  const Image black(walked.width, walked.height, channels);
  LookedAt l{black, black, black, std::vector<uint8_t>(black.values.size() / channels, 0)};
  const PhotographCast& cast = at.cast.photographs[p.photograph];
  const std::vector<Spectrum> by_shader = PredictPixels(
      problem.capture, at.cast, p.photograph, MaterialAt(problem.free, at.x), at.scales.light, problem.options.threads);
  for (const int source : p.pixels) {
    const PixelCast& pixel = cast.pixels[source];
    if (!IsLookedAt(pixel)) continue;
    const size_t place = static_cast<size_t>(pixel.y) * walked.width + pixel.x, rank = walked.RankOf(place);
    l.compared[place] = 1;
    for (size_t g = 0; g < walked.groups; ++g)
      for (int c = 0; c < channels; ++c)
        (g % 2 ? l.second : l.first).at(pixel.x, pixel.y, c) +=
            2.0f * walked.group_values.at(rank * walked.groups + g, c) / static_cast<float>(walked.groups);
    for (int c = 0; c < channels; ++c) l.shader.at(pixel.x, pixel.y, c) = static_cast<float>(by_shader[source][c]);
  }
  return l;
}

/// One look with so many paths a pixel.
SceneLook Look(const FitProblem& problem, const CrownInput& input, const FitState& at, int paths_per_pixel,
               Progress& progress) {
  const Material material = MaterialAt(problem.free, at.x);
  Bodies bodies(input, problem.options.threads);
  std::vector<size_t> photographs;
  for (const FitPixels& p : at.pixels) photographs.push_back(p.photograph);
  double off = 0, noise = 0, blocks = 0, pixels = 0;
  for (const std::vector<size_t>& shared : WhichShareWalks(input.capture, photographs)) {
    PathOptions options;
    options.paths_per_pixel = paths_per_pixel;
    options.seed = problem.options.seed;
    options.stream = Key(kLookStream, photographs[shared[0]]);
    options.threads = problem.options.threads;
    options.keeps_groups = true;
    const PhotographSpec& spec = input.capture.photographs[photographs[shared[0]]];
    options.wanted.assign(static_cast<size_t>(spec.camera.width) * spec.camera.height, 0);
    std::vector<size_t> together;
    for (const size_t k : shared) {
      together.push_back(photographs[k]);
      for (const int source : at.pixels[k].pixels) {
        const PixelCast& pixel = at.cast.photographs[photographs[k]].pixels[source];
        if (IsLookedAt(pixel)) options.wanted[static_cast<size_t>(pixel.y) * spec.camera.width + pixel.x] = 1;
      }
    }
    const std::vector<PathPhotograph> walked =
        RenderTogether(input.capture, bodies.Of(material), input.scenery, material, together, options,
                       [&](double share) { progress.Show("sampling the scene", share, spec.name); });
    for (size_t i = 0; i < shared.size(); ++i) {
      const LookedAt l = Halves(problem, at, at.pixels[shared[i]], walked[i]);
      Image mean = l.first;
      for (size_t v = 0; v < mean.values.size(); ++v) mean.values[v] = 0.5f * (l.first.values[v] + l.second.values[v]);
      const ColourTransform& rgb = input.capture.photographs[together[i]].rgb_from_sensor;
      const ColourDifference d = ComparePictures(mean, l.shader, l.compared, rgb);
      const double weight = static_cast<double>(d.blocks);
      // The halves differ by twice the noise of their mean.
      noise += 0.5 * weight * ComparePictures(l.first, l.second, l.compared, rgb).median;
      off += weight * d.median;
      blocks += weight;
      pixels += static_cast<double>(d.pixels);
    }
  }
  if (blocks == 0)
    throw InputError(input.capture.file, "--target-de00 or --budget-s",
                     "the photographs show too few pixels of the object to plan with",
                     "Choose with --model and --walks instead.");
  off /= blocks;
  noise /= blocks;
  constexpr double kHidden = 0.5;  // a difference of so much of the noise may not show
  return {std::sqrt(std::max(0.0, off * off - noise * noise) + kHidden * kHidden * noise * noise), noise,
          paths_per_pixel * pixels / blocks};
}

/// By which a fit by so many walks is off. Its numbers take over the noise of as many means as a photograph has numbers
/// to tell; half of what is allowed is left to the rest (noise of derivatives and of the photographs).
double PathDe00(const FitProblem& problem, const FitState& at, const SceneLook& look, double paths) {
  const double told = std::max(1.0, static_cast<double>(problem.free.count()) / static_cast<double>(at.pixels.size()));
  return 2.0 * look.noise_de00 * std::sqrt(told * look.paths_per_block / paths);
}

/// Looks until it is known whether `shader` keeps a target, or walks' noise is half of that; at what they cost where
/// only a budget is stated.
SceneLook LookAtScene(const FitProblem& problem, const CrownInput& input, const FitState& at, Progress& progress) {
  constexpr int kFewest = 48, kMost = 768;  // whole groups, with three channels that scatter differently too
  constexpr double kEnough = 0.5, kWithoutTarget = 1.0;
  const std::optional<double>& target = problem.options.target_de00;
  SceneLook look;
  for (int paths = kFewest; paths <= kMost; paths *= 4) {
    look = Look(problem, input, at, paths, progress);
    if (look.noise_de00 <= (target ? kEnough * *target : kWithoutTarget)) break;
    if (target && look.shader_de00 - 2.0 * look.noise_de00 > *target) break;
  }
  return look;
}

std::vector<FitPlan> PlansFor(const FitProblem& problem, const FitState& at, const SceneLook& look) {
  const FitSeconds seconds(problem, at);
  std::vector<FitPlan> plans;
  // `shader` draws the two outer layers. What is free below them it can't see.
  const bool sees_all = std::ranges::all_of(problem.free.entries,
                                            [](const FreeEntry& e) { return e.layer == kSurfaceOwner || e.layer < 2; });
  if (sees_all) plans.push_back({Model::kShader, 0, look.shader_de00, seconds.ByShader(), {}});
  for (const size_t paths : {50000u, 100000u, 200000u, 500000u, 1250000u, 2500000u, 5000000u, 10000000u}) {
    const double n = static_cast<double>(paths);
    plans.push_back({Model::kPath, paths, PathDe00(problem, at, look, n), seconds.ByWalks(n), {}});
  }
  return plans;
}

FitPlan ChoosePlan(const std::vector<FitPlan>& plans, const SceneLook& look, const FitOptions& options) {
  const double target = options.target_de00.value_or(HUGE_VAL), budget = options.budget_s.value_or(HUGE_VAL);
  const FitPlan* chosen = nullptr;
  for (const FitPlan& plan : plans) {
    if (plan.de00 > target || plan.seconds > budget) continue;
    if (!chosen || (options.target_de00 ? plan.seconds < chosen->seconds : plan.de00 < chosen->de00)) chosen = &plan;
  }
  const auto all = [&] {
    std::string text;
    for (const FitPlan& plan : plans)
      text += (text.empty() ? "" : "; ") + Words(plan) + ": CIEDE2000 " + Number(plan.de00, 2) + ", " +
              Seconds(plan.seconds);
    return text;
  };
  if (!chosen)
    throw InputError("", options.target_de00 ? "--target-de00" : "--budget-s",
                     "no model can keep this limit for this scene. Estimates: " + all(),
                     "Relax the limit, or choose with --model and --walks.");
  std::string asked;
  if (options.target_de00) asked += "CIEDE2000 " + Number(*options.target_de00, 2);
  if (options.budget_s) asked += (asked.empty() ? "" : " and ") + Seconds(*options.budget_s);
  FitPlan plan = *chosen;
  plan.why = Words(plan) + " for " + asked + ": about CIEDE2000 " + Number(chosen->de00, 2) + ", at most about " +
             Seconds(chosen->seconds) + " on two cores (model shader is off by " + Number(look.shader_de00, 2) +
             " at the start values)";
  return plan;
}

}  // namespace

FitPlan PlanFit(const std::vector<Capture>& captures, const FitOptions& options, Progress& progress) {
  if (captures.size() > 1)
    throw InputError(captures[1].file, options.target_de00 ? "--target-de00" : "--budget-s",
                     "a plan is made for one capture, not for several that are fitted together",
                     "Choose with --model and --walks instead.");
  if (captures[0].photographs.empty())
    return {Model::kAuto, options.paths_per_photograph, 0, 0,
            "the capture has only measurements of flat samples, so the model is layered"};
  Capture capture = captures[0];
  ApplyOverrides(capture, options.overrides);
  CheckShaderSupports(capture);
  progress.Show("reading", 0.0);
  CrownInput input = ReadInput(capture, options.threads);
  LeaveOut(options, input, progress);
  const FreeParameters free = FreeParametersOf(input.capture);
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{input.capture, free, no_errors, options};
  LinearisedPrediction ignored;
  const FitState at = StateAtStart(problem, input, ignored, progress);
  const SceneLook look = LookAtScene(problem, input, at, progress);
  return ChoosePlan(PlansFor(problem, at, look), look, options);
}

FitOptions WithPlan(FitOptions options, const FitPlan& plan) {
  options.model = plan.model;
  options.model_choice = plan.why;
  if (plan.paths_per_photograph > 0) options.paths_per_photograph = plan.paths_per_photograph;
  return options;
}

}  // namespace crownfit
