#include "fit_crown.h"

#include <algorithm>
#include <cmath>

#include "fit_pixels.h"
#include "fit_steps.h"
#include "optics/twelve_taps.h"

namespace crownfit {

CrownFit FitCrown(const Capture& stated, const FitOptions& options, Progress& progress) {
  CrownFit fit;
  fit.options = options;
  fit.capture = stated;
  ApplyOverrides(fit.capture, options.overrides);
  CheckShaderSupports(fit.capture);

  CrownInput input = ReadInput(fit.capture, options.threads);
  const FreeParameters free = FreeParametersOf(fit.capture);
  const std::vector<CalibrationError> errors = StatedErrors(fit.capture);
  CastOptions cast_options;
  cast_options.threads = options.threads;
  if (options.twelve_taps) cast_options.kernel = TwelveTapKernel();
  cast_options.shade_scenery = AnyBlurred(fit.capture);  // a lens spreads its light over the object

  SolveOptions solve_options;
  solve_options.use_priors = options.use_priors;
  Eigen::VectorXd x = StartVector(free);
  CastState state;
  std::vector<FitPixels> pixels;
  Evaluation at_solution;
  CalibrationState calibration{std::vector<double>(errors.size(), 0.0), {}};
  constexpr int kMaxCasts = 10;
  for (bool again = true; again && fit.casts < kMaxCasts; ++fit.casts) {
    input.capture = Moved(fit.capture, errors, calibration.amounts);
    state = CastAll(input, ThicknessesOf(fit.capture, MaterialAt(free, x)), cast_options, progress);
    pixels = ChoosePixels(input, state, options.max_pixels_per_photograph);
    if (fit.casts > 0 && !errors.empty())  // the first fit takes the calibration as it is
      calibration.slopes = SlopesOf(input, fit.capture, errors, calibration.amounts, state, MaterialAt(free, x),
                                    at_solution.scales.light, cast_options, pixels, progress);
    const ImageResiduals residuals(fit.capture, state, free, pixels, calibration, {3.0, options.threads});
    if (fit.casts == 0) x = BracketStart(residuals, free, solve_options, x);
    const SolveResult solved = Solve(residuals, free, x, solve_options, [&](int iteration, double cost) {
      const double chi2 = 2.0 * cost / std::max(1, residuals.count());
      progress.Show("fitting", 1.0 - std::exp(-0.15 * iteration), "chi2 " + std::to_string(chi2));
    });
    const Eigen::VectorXd cast_at = x;
    x = solved.x;
    at_solution = residuals.Evaluate(x, true);
    fit.uncertainty = Quantify(fit.capture, state, free, x, at_solution, pixels, options.use_priors);
    again = MoveCalibration(at_solution.scales, calibration) || solved.thickness_moved ||
            GeometryIsStale(free, cast_at, x, fit.uncertainty);
    fit.iterations += solved.iterations;
    fit.converged = solved.converged && !again;
    if (again && !solved.thickness_moved) x = HalfWay(free, cast_at, x);
  }

  fit.material = MaterialAt(free, x);
  fit.scales = at_solution.scales;
  fit.mean_thickness_mm = state.crown->thickness_mm;
  fit.ends_at_neck = !state.crown->cut.triangles.empty();
  fit.messages = input.source.messages;
  for (const FitPixels& p : pixels) fit.fitted_pixels += p.pixels.size();
  fit.photographs = ComparePhotographs(input, state, fit.material, at_solution.scales, pixels, options.threads);
  fit.calibration = HowFarMoved(errors, calibration.amounts);
  fit.caveats = PhotographCaveats(fit.capture, input.photographs);
  Judge(fit);
  return fit;
}

}  // namespace crownfit
