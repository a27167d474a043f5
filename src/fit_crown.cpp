#include "fit_crown.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "fit/calibration_derivatives.h"
#include "fit/choose_pixels.h"
#include "fit/fit_measurements.h"
#include "fit/fit_shader.h"
#include "fit/judge.h"
#include "fit/prior_file.h"
#include "fit_path/fit_by_walks.h"
#include "fit_path/predict_by_walks.h"
#include "fit_path/scenery_levels.h"
#include "fit_path/walk_profiles.h"
#include "plan/foresee_photographs.h"
#include "plan/scene_requirements.h"
#include "scene/cast_capture.h"
#include "shader/twelve_taps.h"

namespace crownfit {
namespace {

/// Chooses the cheapest model that suffices, unless one was requested; finishes the fit with it, and records why.
void FitByTheModelThatSuffices(const FitProblem& problem, CrownInput& input, FitState& at, CrownFit& fit,
                               Progress& progress) {
  const Model asked = problem.options.model;
  fit.model = !GoesOnToWalks(problem, at) ? Model::kShader : asked == Model::kDiffusion ? asked : Model::kPath;
  fit.model_choice = asked == Model::kAuto ? ChoiceAfter(problem, at).why : problem.options.model_choice;
  if (fit.model != Model::kShader && !FitByWalks(problem, input, at, asked == Model::kAuto, progress)) {
    fit.model = Model::kShader;
    fit.model_choice += "; path explains the photographs less well, as if shader had rendered them";
    if (at.converged) return;
    FitOptions to_its_end = problem.options;  // walks needed only a start; others know the path model
    to_its_end.model = Model::kShader;
    at = FitByShader({problem.capture, problem.free, problem.errors, to_its_end}, input, progress);
    fit.seen_by_shader = MaterialAt(problem.free, at.x);
  }
}

/// Departures from shared scattering by shader, once every channel is free. Called where a fit has ended.
std::vector<LawDeparture> DeparturesByShader(const FitProblem& problem, const FitState& at, Progress& progress) {
  if (!at.converged || !KeepsALaw(problem.capture)) return {};
  const Capture freed = WithoutLaws(problem.capture, MaterialAt(problem.free, at.x));
  const FreeParameters free = FreeParametersOf(freed);
  progress.Show("shared scattering", 0.5);
  const ImageResiduals residuals(freed, at.cast, free, at.pixels, at.calibration, {3.0, problem.options.threads});
  SolveOptions solve_options;
  solve_options.use_priors = problem.options.use_priors;
  const SolveResult solved = Solve(residuals, free, StartVector(free), solve_options, [](int, double) {});
  if (!solved.converged || solved.thickness_moved) return {};
  return DeparturesFromLaws(problem.capture, free,
                            KnowledgeByShader(at.cast, free, solved.x, residuals.Evaluate(solved.x, true), at.pixels));
}

/// Profiles of every weak entry. Where the model is cheap, they are fits of the rest; where it is path-traced, they
/// come from derivatives at half as many points. Otherwise, and where the model does not fit the photographs, they are
/// parabolas. Changes the state of `at` and `input`.
std::vector<LikelihoodProfile> ProfilesOf(const FitProblem& problem, CrownInput& input, FitState& at,
                                          const CrownFit& fit, Progress& progress) {
  const auto& [capture, free, errors, options, others] = problem;
  const Eigen::MatrixXd& covariance = fit.uncertainty.covariance;
  std::vector<int> weak;
  for (int k = 0; k < free.count(); ++k)
    if (IsWeak(free.entries[k], at.x[k], std::sqrt(covariance(k, k)))) weak.push_back(k);
  std::vector<LikelihoodProfile> profiles;
  if (weak.empty()) return profiles;
  const bool holds = at.converged && !at.residual_chi2.IsMoreThan(kChi2Limit);
  if (!holds || options.profile_points == 0 || !others.names.empty()) {
    for (const int k : weak) profiles.push_back(QuadraticProfile(free, at.x, covariance, k));
    return profiles;
  }
  if (fit.is_by_walks())
    return ProfilesByWalks(problem, input, at, weak, fit.uncertainty, (options.profile_points + 1) / 2, progress);
  const ImageResiduals residuals(capture, at.cast, free, at.pixels, at.calibration, {3.0, options.threads});
  const Profiler profiler(residuals, free, at.x, fit.uncertainty.inflation, options.use_priors);
  for (const int k : weak) {
    progress.Show("likelihood profiles", static_cast<double>(profiles.size()) / static_cast<double>(weak.size()),
                  free.entries[k].name);
    profiles.push_back(profiler.Of(k, std::sqrt(covariance(k, k)), options.profile_points));
  }
  return profiles;
}

}  // namespace

CrownFit FitCrown(const Capture& stated, const FitOptions& options, Progress& progress, const KnownBeside& beside) {
  if (stated.photographs.empty()) return FitMeasurements(stated, options, progress, beside);
  if (options.model == Model::kLayered)
    throw InputError(stated.file, "--model", "model layered is for flat samples, but this capture has photographs",
                     "Use --model auto, shader or path; the measurements are fitted with the photographs.");
  CrownFit fit;
  fit.options = options;
  fit.capture = stated;
  ApplyOverrides(fit.capture, options.overrides);
  CheckShaderSupports(fit.capture);

  CrownInput input = ReadInput(fit.capture, options.threads);
  for (LeftOutPart& part : LeaveOut(options, input, progress)) {
    fit.left_out.push_back(part.name);
    fit.caveats.push_back(std::move(part.finding));
  }
  fit.capture = input.capture;  // with bounds that follow from its crown
  FreeParameters free = FreeParametersOf(fit.capture);
  if (!options.prior.empty()) TakePriors(options.prior, fit.capture, free);
  if (beside.start.size() > 0) StartFrom(beside.start, free);
  const std::vector<CalibrationError> errors = StatedErrors(fit.capture);
  const FitProblem problem{fit.capture, free, errors, options, beside.others};
  FitState at = FitByShader(problem, input, progress);
  fit.seen_by_shader = MaterialAt(free, at.x);
  FitByTheModelThatSuffices(problem, input, at, fit, progress);

  fit.material = MaterialAt(free, at.x);
  fit.knowledge = at.knowledge;
  fit.uncertainty = Quantify(fit.capture, free, at.x, at.knowledge.With(beside.others), options.use_priors);
  if (beside.start.size() == 0)  // a joint fit uses each capture's own test
    fit.departures = fit.is_by_walks() ? at.departures : DeparturesByShader(problem, at, progress);
  fit.scales = at.scales;
  fit.iterations = at.iterations;
  fit.casts = at.casts;
  fit.entries = free.entries;
  fit.best = at.x;
  fit.iterations_by_shader = at.iterations_by_shader;
  fit.steps = at.steps;
  fit.walked_paths = at.walked_paths;
  fit.rival_roughness = at.rival_roughness;
  fit.converged = at.converged;
  fit.mean_thickness_mm = at.cast.crown->thickness_mm;
  for (size_t l = 0; l < fit.capture.layers.size(); ++l)  // a field was built with its scale; a mesh is used as given
    if (fit.capture.layers[l].thickness_field) fit.mean_thickness_mm[l] /= at.cast.thickness_mm[l];
  fit.ends_at_neck = !at.cast.crown->cut.triangles.empty();
  fit.messages = input.source.messages;
  if (const std::string note = DepthNote(fit.capture, *at.cast.crown); !note.empty()) fit.messages.push_back(note);
  for (const FitPixels& p : at.pixels) fit.fitted_pixels += p.pixels.size();
  const Predictor predict = fit.is_by_walks()
                                ? PredictorByWalks(problem, input, at, progress)
                                : PredictorByShader(input, at.cast, fit.material, at.scales, options.threads);
  fit.photographs =
      ComparePhotographs(input, at.cast, predict, at.scales, at.pixels, options.threads, at.knowledge.scales_stddev);
  fit.residual_chi2 = at.residual_chi2;
  for (size_t g = 0; g < at.residual_chi2_of.size(); ++g)
    if (at.residual_chi2_of[g].patches.values > 0)
      fit.photographs[at.pixels[g].photograph].residual_chi2 = at.residual_chi2_of[g];
  if (fit.is_by_walks()) fit.scenery = SceneryLevelsOf(problem, input, at, fit.photographs, progress);
  fit.readings = CompareMeasurements(fit.capture, fit.material);
  fit.calibration = HowFarMoved(errors, at.calibration.amounts);
  for (auto& scaled : HowFarScaled(fit.capture, at.pixels, at.scales)) fit.calibration.push_back(std::move(scaled));
  fit.inflation = at.inflation;
  for (auto& caveat : PhotographFindings(fit.capture, input.photographs)) fit.caveats.push_back(std::move(caveat));
  if (const Foresight more = options.advises ? ForeseePhotographs(problem, input, at, progress) : Foresight{};
      more.IsWorthTaking())
    fit.advice = AdviceIn(free, more);
  for (auto& caveat : ModelFindings(fit)) fit.caveats.push_back(std::move(caveat));
  fit.profiles = ProfilesOf(problem, input, at, fit, progress);
  Judge(fit);
  return fit;
}

}  // namespace crownfit
