#include "fit/fit_measurements.h"

#include <cmath>

#include "base/error.h"
#include "fit/fit_options.h"
#include "fit/fit_result.h"
#include "fit/judge.h"
#include "fit/prior_file.h"
#include "optics/flat_reading.h"

namespace crownfit {
namespace {

/// Layers without a thickness of their own get the samples' mean, from which `predict` starts.
void SetThicknesses(Capture& capture, CrownFit& fit) {
  const double samples = static_cast<double>(capture.measurements.size());
  for (size_t l = 0; l < capture.layers.size(); ++l) {
    double mean = 0;
    for (const FlatMeasurement& m : capture.measurements) mean += m.thickness_mm[l] / samples;
    ParameterSpec& thickness = capture.layers[l][Quantity::kThickness];
    if (!thickness.stated) thickness.value.fill(mean);
    thickness.stated = true;
    fit.mean_thickness_mm.push_back(mean);
  }
}

/// Profiles of every weak entry: by fits, which take milliseconds; parabolas where other captures constrain the
/// entries.
std::vector<LikelihoodProfile> ProfilesOf(const ImageResiduals& residuals, const FreeParameters& free,
                                          const CrownFit& fit, bool alone) {
  std::vector<LikelihoodProfile> profiles;
  const Profiler profiler(residuals, free, fit.best, fit.uncertainty.inflation, fit.options.use_priors);
  for (int k = 0; k < free.count(); ++k) {
    const double stddev = std::sqrt(fit.uncertainty.covariance(k, k));
    if (!IsWeak(free.entries[k], fit.best[k], stddev)) continue;
    profiles.push_back(alone && fit.options.profile_points > 0 && fit.converged
                           ? profiler.Of(k, stddev, fit.options.profile_points)
                           : QuadraticProfile(free, fit.best, fit.uncertainty.covariance, k));
  }
  return profiles;
}

const CastState kNoCast{};
const std::vector<FitPixels> kNoPixels{};
const CalibrationState kNoCalibration{};

/// Precision of what else constrains entries: priors, other captures. Empty: nothing.
Eigen::MatrixXd HeldBy(const FreeParameters& free, bool use_priors, const GaussianInformation& others) {
  Eigen::MatrixXd held = Eigen::MatrixXd::Zero(free.count(), free.count());
  for (int k = 0; use_priors && k < free.count(); ++k) held(k, k) = std::pow(free.entries[k].prior_stddev, -2.0);
  if (!others.names.empty()) held += others.precision;
  return held.isZero() ? Eigen::MatrixXd() : held;
}

/// Departures from shared scattering, found by a fit in which every channel is free.
std::vector<LawDeparture> DeparturesOf(const CrownFit& fit) {
  if (!fit.converged || !KeepsALaw(fit.capture)) return {};
  const Capture freed = WithoutLaws(fit.capture, fit.material);
  const FreeParameters free = FreeParametersOf(freed);
  const ImageResiduals residuals(freed, kNoCast, free, kNoPixels, kNoCalibration, {0.0, fit.options.threads});
  SolveOptions solve_options;
  solve_options.use_priors = fit.options.use_priors;
  const SolveResult solved = Solve(residuals, free, StartVector(free), solve_options, [](int, double) {});
  if (!solved.converged) return {};
  return DeparturesFromLaws(fit.capture, free,
                            KnowledgeByShader(kNoCast, free, solved.x, residuals.Evaluate(solved.x, true), kNoPixels,
                                              /*with_model_errors=*/false, HeldBy(free, fit.options.use_priors, {})));
}

}  // namespace

CrownFit FitMeasurements(const Capture& stated, const FitOptions& options, Progress& progress,
                         const KnownBeside& beside) {
  if (options.model != Model::kAuto && options.model != Model::kLayered)
    throw InputError(stated.file, "--model",
                     "model " + std::string(Word(options.model)) + " needs photographs, but this capture has none",
                     "Use --model auto or layered.");
  if (!options.leave_out.empty())
    throw InputError(stated.file, "--leave-out",
                     "only captures with photographs have parts of a scene, but this capture has none",
                     "Remove the option.");
  CrownFit fit;
  fit.options = options;
  fit.capture = stated;
  ApplyOverrides(fit.capture, options.overrides);
  SetThicknesses(fit.capture, fit);
  fit.model = Model::kLayered;
  fit.model_choice = "the capture has only measurements of flat samples";

  FreeParameters free = FreeParametersOf(fit.capture);
  if (!options.prior.empty()) TakePriors(options.prior, fit.capture, free);
  if (beside.start.size() > 0) StartFrom(beside.start, free);
  const ImageResiduals residuals(fit.capture, kNoCast, free, kNoPixels, kNoCalibration, {0.0, options.threads});
  SolveOptions solve_options;
  solve_options.use_priors = options.use_priors;
  solve_options.others = beside.others;
  progress.Show("searching for a start", 0.0);
  const Eigen::VectorXd start = BracketStart(residuals, free, solve_options, StartVector(free));
  const SolveResult solved = Solve(residuals, free, start, solve_options, [&](int iteration, double cost) {
    const double chi2 = 2.0 * cost / std::max(1, residuals.count());
    fit.iterations_by_shader.push_back({0, chi2});
    progress.Show("fitting", 1.0 - std::exp(-0.15 * iteration), "chi2 " + std::to_string(chi2));
  });
  fit.best = solved.x;
  fit.entries = free.entries;
  fit.iterations = solved.iterations;
  fit.converged = solved.converged;
  fit.material = MaterialAt(free, solved.x);
  fit.seen_by_shader = fit.material;
  const DataEstimate knowledge =
      KnowledgeByShader(kNoCast, free, solved.x, residuals.Evaluate(solved.x, true), kNoPixels,
                        /*with_model_errors=*/false, HeldBy(free, options.use_priors, beside.others));
  fit.knowledge = knowledge;
  fit.uncertainty = Quantify(fit.capture, free, solved.x, knowledge.With(beside.others), options.use_priors);
  if (beside.start.size() == 0) fit.departures = DeparturesOf(fit);
  fit.profiles = ProfilesOf(residuals, free, fit, beside.others.names.empty());
  fit.readings = CompareMeasurements(fit.capture, fit.material);
  fit.caveats = ModelFindings(fit);
  Judge(fit);
  return fit;
}

DataEstimate ForeseeMeasurements(const Capture& capture, const FreeParameters& free, int threads) {
  Evaluation e = ImageResiduals(capture, kNoCast, free, kNoPixels, kNoCalibration, {0.0, threads})
                     .Evaluate(StartVector(free), true);
  e.residuals.setZero();
  return KnowledgeByShader(kNoCast, free, StartVector(free), e, kNoPixels, /*with_model_errors=*/false);
}

std::vector<ReadingResult> CompareMeasurements(const Capture& capture, const Material& material) {
  std::vector<ReadingResult> results;
  for (const FlatMeasurement& m : capture.measurements) {
    std::vector<BandReading> bands;
    for (int c = 0; c < capture.channels(); ++c) bands.push_back(ReadBand(capture, {m}, material, c)[0]);
    const std::vector<double> predicted = PredictedValues(m, bands);
    size_t k = 0;
    for (const auto& [quantity, reading] :
         {std::pair{"reflectance", &m.reflectance}, {"transmittance", &m.transmittance}, {"lab", &m.lab}}) {
      if (!*reading) continue;
      ReadingResult r{m.name, quantity, m.is_holdout, **reading, (*reading)->value};
      for (int c = 0; c < r.predicted.size(); ++c) r.predicted[c] = predicted[k++];
      results.push_back(r);
    }
  }
  return results;
}

}  // namespace crownfit
