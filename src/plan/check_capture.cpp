#include "plan/check_capture.h"

#include <cmath>

#include "base/error.h"
#include "fit/choose_pixels.h"
#include "fit/fit_measurements.h"
#include "fit/image_residuals.h"
#include "fit/judge.h"
#include "plan/fit_seconds.h"
#include "plan/start_state.h"

namespace crownfit {
namespace {

/// What a fit by walks would know at x, where one by `shader` stands.
DataEstimate KnowledgeByWalks(const FitProblem& problem, const FitState& at, const LinearisedPrediction& prediction,
                              const Eigen::VectorXd& x) {
  const auto knowledge = [&](const std::vector<FitPixels>& pixels) {
    Evaluation e = AgreeingEvaluation(problem, at, pixels, prediction, x);
    for (int k = 0; k < problem.free.count(); ++k)
      if (!HasWalkDerivative(problem.free.entries[k])) e.jacobian.col(k).setZero();
    return KnowledgeByShader(at.cast, problem.free, x, e, pixels, /*with_model_errors=*/false);
  };
  std::vector<FitPixels> walked;
  for (const FitPixels& p : at.pixels)
    walked.push_back(WithNoiseOfWalks(p, static_cast<double>(problem.options.paths_per_photograph)));
  DataEstimate k = knowledge(walked);
  k.of_walks = 1.0 - knowledge(at.pixels).covariance.diagonal().array() / k.covariance.diagonal().array().max(1e-300);
  return k;
}

/// By the readings' own errors alone, as model `layered` has none of its own.
CaptureCheck CheckMeasurements(const Capture& capture, const FitOptions& options) {
  CaptureCheck check;
  check.input.capture = capture;
  const FreeParameters free = FreeParametersOf(capture);
  if (free.count() == 0) return check;
  const DataEstimate knowledge = ForeseeMeasurements(capture, free, options.threads);
  for (int k = 0; k < free.count(); ++k)
    check.foreseen.push_back(
        {free.entries[k].name, "",
         IntervalInWords(free.entries[k], std::sqrt(knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), k))))});
  check.weak_directions = Quantify(capture, free, StartVector(free), knowledge, options.use_priors).weak_directions;
  check.shared = ScatteringThatMayBeShared(capture, [&](const Capture& other, const FreeParameters& others) {
    return ForeseeMeasurements(other, others, options.threads);
  });
  return check;
}

}  // namespace

CaptureCheck CheckCapture(const Capture& stated, const FitOptions& options, Progress& progress) {
  if (stated.photographs.empty()) return CheckMeasurements(stated, options);
  CheckShaderSupports(stated);
  progress.Show("reading", 0.0);
  CaptureCheck check;
  check.input = ReadInput(stated, options.threads);
  check.caveats = PhotographFindings(check.input.capture, check.input.photographs);
  const Coarseness coarse = Coarsen(check.input);
  const Capture& capture = check.input.capture;
  const FreeParameters free = FreeParametersOf(capture);
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{capture, free, no_errors, options};
  LinearisedPrediction prediction;
  FitState at = StateAtStart(problem, check.input, prediction, progress, coarse);
  check.crown = at.cast.crown;
  const FitSeconds seconds(problem, at, coarse);
  check.requirements = SceneRequirements(problem, check.input, at, prediction, seconds, coarse, progress);
  if (free.count() == 0) return check;
  check.exact = ExactStatements(problem, at, prediction);
  check.shader_s = seconds.ByShader();
  check.path_s = seconds.ByWalks(static_cast<double>(options.paths_per_photograph));

  const DataEstimate by_shader =
      KnowledgeByShader(at.cast, free, at.x, AgreeingEvaluation(problem, at, at.pixels, prediction, at.x), at.pixels);
  at.knowledge = KnowledgeByWalks(problem, at, prediction, at.x);
  for (int k = 0; k < free.count(); ++k) {
    const auto interval = [&](const DataEstimate& knowledge) {
      return IntervalInWords(free.entries[k], std::sqrt(knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), k))));
    };
    check.foreseen.push_back({free.entries[k].name, interval(by_shader), interval(at.knowledge)});
  }
  check.weak_directions = Quantify(capture, free, at.x, at.knowledge, options.use_priors).weak_directions;
  check.shared = ScatteringThatMayBeShared(capture, [&](const Capture& other, const FreeParameters& others) {
    return KnowledgeByWalks({other, others, no_errors, options}, at, prediction, StartVector(others));
  });
  const Foresight more = ForeseePhotographs(problem, check.input, at, progress);
  if (more.IsWorthTaking()) check.advice = AdviceIn(free, more);
  return check;
}

}  // namespace crownfit
