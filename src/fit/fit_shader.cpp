#include "fit/fit_shader.h"

#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "capture/capture.h"
#include "fit/calibration_derivatives.h"
#include "fit/choose_pixels.h"
#include "fit/image_residuals.h"
#include "scene/cast_capture.h"
#include "shader/twelve_taps.h"

namespace crownfit {
namespace {

/// True when a fitted thickness requires a new cast: it differs from the cast one by more than 0.1 % and more than a
/// tenth of its standard deviation.
bool GeometryIsStale(const FreeParameters& free, const Eigen::VectorXd& cast_at, const Eigen::VectorXd& x,
                     const DataEstimate& knowledge) {
  constexpr double kMoved = 1e-3;
  for (int k = 0; k < free.count(); ++k) {
    if (!free.entries[k].moves_surface) continue;
    const double stddev = std::sqrt(knowledge.Variance(Eigen::RowVectorXd::Unit(free.count(), k)));
    const double range = free.entries[k].high - free.entries[k].low;
    if (std::abs(x[k] - cast_at[k]) > std::max(kMoved, 0.1 * std::min(stddev, range))) return true;
  }
  return false;
}

/// x with the thicknesses half way between cast and fitted. Scaling the lengths of one cast overshoots about as much as
/// it corrects, so full steps oscillate (seen: 0.6013, 0.5989, 0.6013, ... around 0.6000).
Eigen::VectorXd HalfWay(const FreeParameters& free, const Eigen::VectorXd& cast_at, Eigen::VectorXd x) {
  for (int k = 0; k < free.count(); ++k)
    if (free.entries[k].moves_surface) x[k] = 0.5 * (cast_at[k] + x[k]);
  return x;
}

}  // namespace

FitState FitByShader(const FitProblem& problem, CrownInput& input, Progress& progress) {
  const auto& [capture, free, errors, options, others] = problem;
  CastOptions cast_options;
  cast_options.threads = options.threads;
  if (options.twelve_taps) cast_options.crown.kernel = TwelveTapKernel();
  cast_options.shade_scenery = AnyBlurred(capture);  // a lens spreads its light over the object
  SolveOptions solve_options;
  solve_options.use_priors = options.use_priors;
  if (options.model == Model::kShader) solve_options.others = others;  // otherwise they hold values of the path model

  FitState at;
  at.x = StartVector(free);
  at.calibration.amounts.assign(errors.size(), 0.0);
  // Calibration errors triple a cast's cost, and random walks begin at the stated calibration anyway.
  const int casts_before_walks = errors.empty() ? 3 : 1;
  for (bool again = true; again && at.casts < kMostCasts; ++at.casts) {
    if (at.casts >= casts_before_walks && GoesOnToWalks(problem, at)) break;
    input.capture = Moved(capture, errors, at.calibration.amounts);
    at.cast = CastAll(input, ThicknessesOf(capture, MaterialAt(free, at.x)), cast_options, progress);
    at.pixels = ChoosePixels(input, at.cast, options.max_pixels_per_photograph);
    if (at.casts > 0 && !errors.empty())  // the first fit takes the calibration as it is
      at.calibration.derivatives =
          CalibrationDerivativesOf(input, capture, errors, at.calibration.amounts, at.cast, MaterialAt(free, at.x),
                                   at.scales.light, cast_options, at.pixels, progress);
    const ImageResiduals residuals(capture, at.cast, free, at.pixels, at.calibration, {3.0, options.threads});
    if (at.casts == 0) at.x = BracketStart(residuals, free, solve_options, at.x);
    const SolveResult solved = Solve(residuals, free, at.x, solve_options, [&](int iteration, double cost) {
      const double chi2 = 2.0 * cost / std::max(1, residuals.count());
      at.iterations_by_shader.push_back({at.casts, chi2});
      progress.Show("fitting", 1.0 - std::exp(-0.15 * iteration), "chi2 " + std::to_string(chi2));
    });
    const Eigen::VectorXd cast_at = at.x;
    at.x = solved.x;
    const Evaluation at_solution = residuals.Evaluate(at.x, true);
    at.scales = at_solution.scales;
    at.knowledge = KnowledgeByShader(at.cast, free, at.x, at_solution, at.pixels);
    again = MoveCalibration(at.scales, at.calibration) || solved.thickness_moved ||
            GeometryIsStale(free, cast_at, at.x, at.knowledge);
    at.iterations += solved.iterations;
    at.converged = solved.converged && at.scales.settled && !again;
    if (again && !solved.thickness_moved) at.x = HalfWay(free, cast_at, at.x);
  }
  return at;
}

double OffNarrowPriors(const FreeParameters& free, const Eigen::VectorXd& x) {
  double furthest = 0;
  for (int k = 0; k < free.count(); ++k)
    if (const FreeEntry& e = free.entries[k];
        e.role != FreeEntry::Role::kPowerExponent && e.prior_stddev < RowOf(e.quantity).prior_stddev)
      furthest = std::max(furthest, std::abs(x[k] - e.prior_mean) / e.prior_stddev);
  return furthest;
}

ModelChoice WhetherShaderSuffices(double block_chi2, const std::vector<MovedCalibration>& moved, double off_prior) {
  constexpr double kOfNoise = 1.5, kByChance = 2.0;  // stated errors
  double furthest = 0;
  for (const MovedCalibration& m : moved) furthest = std::max(furthest, m.Stddevs());
  std::string why = "model shader leaves patches of neighbouring pixels off by " + Number(block_chi2, 2) +
                    " times the square of their noise (limit " + Number(kOfNoise, 2) + ")";
  if (furthest > kByChance)
    why += ", and it moved the calibration by " + Number(furthest, 2) + " times its stated error (limit " +
           Number(kByChance, 2) + ")";
  if (off_prior > kByChance)
    why += ", and it departed from a narrow prior by " + Number(off_prior, 2) + " standard deviations (limit " +
           Number(kByChance, 2) + ")";
  return {block_chi2 <= kOfNoise && std::max(furthest, off_prior) <= kByChance, why};
}

ModelChoice ChoiceAfter(const FitProblem& problem, const FitState& by_shader) {
  return WhetherShaderSuffices(by_shader.knowledge.block_chi2,
                               HowFarMoved(problem.errors, by_shader.calibration.amounts),
                               problem.options.use_priors ? OffNarrowPriors(problem.free, by_shader.x) : 0.0);
}

bool GoesOnToWalks(const FitProblem& problem, const FitState& by_shader) {
  const Model asked = problem.options.model;
  return asked == Model::kPath || asked == Model::kDiffusion ||
         (asked == Model::kAuto && !ChoiceAfter(problem, by_shader).suffices);
}

}  // namespace crownfit
