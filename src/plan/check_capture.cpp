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
DataEstimate KnowledgeByWalks(const FitProblem& problem, const FitState& at, const Eigen::VectorXd& x) {
  const auto knowledge = [&](const std::vector<FitPixels>& pixels) {
    Evaluation e = ImageResiduals(problem.capture, at.cast, problem.free, pixels, {}, {0.0, problem.options.threads})
                       .Evaluate(x, true);
    e.residuals.setZero();
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
  const Capture& capture = check.input.capture;
  const FreeParameters free = FreeParametersOf(capture);
  const std::vector<CalibrationError> no_errors;
  const FitProblem problem{capture, free, no_errors, options};
  Evaluation e;
  FitState at = StateAtStart(problem, check.input, e, progress);
  check.crown = at.cast.crown;
  check.caveats = PhotographFindings(capture, check.input.photographs);
  const FitSeconds seconds(problem, check.input, at);
  check.requirements = SceneRequirements(problem, check.input, at, seconds, progress);
  if (free.count() == 0) return check;
  check.exact = ExactStatements(problem, at);
  check.shader_s = seconds.ByShader();
  check.path_s = seconds.ByWalks(static_cast<double>(options.paths_per_photograph));

  const DataEstimate by_shader = KnowledgeByShader(at.cast, free, at.x, e, at.pixels);
  at.knowledge = KnowledgeByWalks(problem, at, at.x);
  for (int k = 0; k < free.count(); ++k) {
    const auto interval = [&](const DataEstimate& knowledge) {
      return IntervalInWords(free.entries[k], std::sqrt(knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), k))));
    };
    check.foreseen.push_back({free.entries[k].name, interval(by_shader), interval(at.knowledge)});
  }
  check.weak_directions = Quantify(capture, free, at.x, at.knowledge, options.use_priors).weak_directions;
  check.shared = ScatteringThatMayBeShared(capture, [&](const Capture& other, const FreeParameters& others) {
    progress.Show("shared scattering", 0.5);
    return KnowledgeByWalks({other, others, no_errors, options}, at, StartVector(others));
  });
  const Foresight more = ForeseePhotographs(problem, check.input, at, progress);
  if (more.IsWorthTaking()) check.advice = AdviceIn(free, more);
  return check;
}

}  // namespace crownfit
