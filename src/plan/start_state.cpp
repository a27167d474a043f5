#include "plan/start_state.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "scene/cast_capture.h"

namespace crownfit {

FitState StateAtStart(const FitProblem& problem, const CrownInput& input, LinearisedPrediction& prediction,
                      Progress& progress, const Coarseness& coarse) {
  CastOptions cast_options = coarse.cast;
  cast_options.threads = problem.options.threads;
  FitState at;
  at.x = StartVector(problem.free);
  at.cast = CastAll(input, ThicknessesOf(problem.capture, MaterialAt(problem.free, at.x)), cast_options, progress);
  at.pixels = ChoosePixels(input, at.cast, problem.options.max_pixels_by_walks());
  for (FitPixels& p : at.pixels) {
    const double all = coarse.Merged(p.photograph) * static_cast<double>(p.pixels.size());
    const double share = std::min(1.0, static_cast<double>(problem.options.max_pixels_by_walks()) / all);
    for (Spectrum& s : p.stddev) s /= std::sqrt(share);
  }
  const ImageResiduals residuals(problem.capture, at.cast, problem.free, at.pixels, {}, {3.0, problem.options.threads});
  prediction = residuals.Linearise(at.x);
  const Evaluation e = residuals.EvaluateBy(prediction, at.x);
  if (!e.finite)
    throw InputError(problem.capture.file, "object", "model shader predicts no finite picture at the start values",
                     "Look for lengths, coefficients or lamps that are wrong by powers of ten.");
  at.scales = e.scales;
  return at;
}

Evaluation AgreeingEvaluation(const FitProblem& problem, const FitState& at, const std::vector<FitPixels>& pixels,
                              const LinearisedPrediction& prediction, const Eigen::VectorXd& x) {
  Evaluation e = ImageResiduals(problem.capture, at.cast, problem.free, pixels, {}, {0.0, problem.options.threads})
                     .EvaluateBy(prediction, x);
  e.residuals.setZero();
  return e;
}

}  // namespace crownfit
