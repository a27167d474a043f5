#include "plan/start_state.h"

#include "base/error.h"
#include "capture/capture.h"
#include "fit/choose_pixels.h"
#include "scene/cast_capture.h"

namespace crownfit {

FitState StateAtStart(const FitProblem& problem, const CrownInput& input, Evaluation& e, Progress& progress) {
  CastOptions cast_options;
  cast_options.threads = problem.options.threads;
  FitState at;
  at.x = StartVector(problem.free);
  at.cast = CastAll(input, ThicknessesOf(problem.capture, MaterialAt(problem.free, at.x)), cast_options, progress);
  at.pixels = ChoosePixels(input, at.cast, problem.options.max_pixels_by_walks());
  e = ImageResiduals(problem.capture, at.cast, problem.free, at.pixels, {}, {3.0, problem.options.threads})
          .Evaluate(at.x, true);
  if (!e.finite)
    throw InputError(problem.capture.file, "object", "model shader predicts no finite picture at the start values",
                     "Look for lengths, coefficients or lamps that are wrong by powers of ten.");
  at.scales = e.scales;
  e.residuals.setZero();
  return at;
}

}  // namespace crownfit
