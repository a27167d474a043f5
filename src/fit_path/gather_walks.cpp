#include "fit_path/gather_walks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "base/linear_algebra.h"
#include "base/parallel.h"
#include "capture/capture.h"
#include "fit/calibration_derivatives.h"
#include "fit/choose_pixels.h"
#include "fit/flat_residuals.h"
#include "fit/neighbouring_noise.h"
#include "fit_path/walk_schedule.h"
#include "scene/cast_capture.h"
#include "shader/predict.h"
#include "shader/twelve_taps.h"

namespace crownfit {
namespace {

/// Of a layer: reduced scattering over scattering.
double Similarity(const Material::Layer& l) {
  return 1.0 - (1.0 - l[Quantity::kIsotropicFraction][0]) * l[Quantity::kAsymmetry][0];
}

}  // namespace

int CollisionsThatTell(const Material& material) {
  constexpr double kTransportPaths = 1.3, kMost = 100.0;
  return static_cast<int>(std::ceil(std::min(kMost, kTransportPaths / std::max(1e-3, Similarity(material.layers[0])))));
}

int CollisionsThatDepolarise(const PhotographSpec& photo) {
  constexpr double kMemories = 3.0, kMost = 100.0;
  return static_cast<int>(std::ceil(std::min(kMost, kMemories * photo.polarisation_memory_events)));
}

ModelError DiffusionError(const Material& material, const FitOptions& options) {
  constexpr ModelError kLeast{0.03, 0.02, 0.01};
  constexpr double kEnough = 3.0, kMost = 4.0;            // transport paths; times
  if (options.model != Model::kDiffusion) return kLeast;  // a search on the way to walks that have none
  const double walked = options.collisions * Similarity(material.layers.front());
  const double times = std::clamp(std::sqrt(kEnough / std::max(0.1, walked)), 1.0, kMost);
  return {times * kLeast.patch, times * kLeast.photograph, times * kLeast.channel};
}

int FewestPaths(const Material& material) {
  const bool is_grey = std::all_of(material.layers.begin(), material.layers.end(),
                                   [](const Material::Layer& l) { return l[Quantity::kReducedScattering].IsGrey(); });
  return static_cast<int>(PathPhotograph::kMaxGroups) * (is_grey ? 1 : material.channels());
}

void MoveInput(const FitProblem& problem, const FitState& at, CrownInput& input) {
  input.capture = Moved(problem.capture, problem.errors, at.calibration.amounts);
  for (size_t l = 0; l < input.capture.lights.size(); ++l) input.capture.lights[l].intensity_scale = at.scales.light[l];
}

WalkGatherer::WalkGatherer(const FitProblem& problem, CrownInput& input, FitState& at, const WalkUnknowns& unknowns,
                           Progress& progress)
    : problem_(problem),
      input_(input),
      at_(at),
      unknowns_(unknowns),
      progress_(progress),
      bodies_(input, problem.options.threads),
      derivatives_(at.pixels.size()) {
  for (const DerivativeParameter& p : DifferencedParameters(problem.capture))
    if (unknowns_.IsFree(p) && p.quantity != Quantity::kRoughness) differenced_.push_back(p);
  bodies_.ResolvePathsFrom(kShortestOfSearch);
  TakeNoiseFromNeighbours();
}

void WalkGatherer::TakePixels(size_t at_most) {
  MoveInput(problem_, at_, input_);
  const Material material = MaterialAt(problem_.free, at_.x);
  CastOptions options;
  options.threads = problem_.options.threads;
  if (problem_.options.twelve_taps) options.crown.kernel = TwelveTapKernel();
  options.shade_scenery = AnyBlurred(problem_.capture);
  if (!problem_.errors.empty())
    at_.cast = CastAll(input_, ThicknessesOf(problem_.capture, material), options, progress_);
  at_.pixels = ChoosePixels(input_, at_.cast, at_most);
  if (!problem_.errors.empty())
    at_.calibration.derivatives =
        CalibrationDerivativesOf(input_, problem_.capture, problem_.errors, at_.calibration.amounts, at_.cast, material,
                                 at_.scales.light, options, at_.pixels, progress_);
  derivatives_.assign(at_.pixels.size(), {});
  TakeNoiseFromNeighbours();
}

void WalkGatherer::TakeNoiseFromNeighbours() {
  const Material material = MaterialAt(problem_.free, at_.x);
  stated_noise_.clear();
  for (FitPixels& p : at_.pixels) {
    const std::vector<Spectrum> shaded =
        PredictPixels(input_.capture, at_.cast, p.photograph, material, at_.scales.light, problem_.options.threads);
    std::vector<Spectrum> light;
    for (size_t i = 0; i < p.pixels.size(); ++i) {
      light.push_back(p.SceneryAt(i));
      for (const auto& [source, weight] : p.TermsOf(i))
        light[i] += static_cast<double>(weight) * shaded[p.sources[source]];
    }
    stated_noise_.push_back(p.stddev);
    p.stddev = NoiseOfNeighbours(p, CastOf(p), p.stddev, light);
  }
}

/// What the mean picture that derivatives came with tells of a photograph: how its noise goes with the light, and how
/// its pixels differ from their neighbours.
void WalkGatherer::LearnFromPicture(size_t g, const std::vector<size_t>& ranks) {
  FitPixels& p = at_.pixels[g];
  std::vector<WalkedPicture> pictures;
  for (const SlopesFound& f : derivatives_[g]) pictures.push_back({&f.picture, f.paths});
  const KnownPicture mean = MeanPicture(p, unknowns_.ExposureOf(p), ranks, pictures);
  p.stddev = NoiseOfNeighbours(p, CastOf(p), stated_noise_[g], OverNearest(p, CastOf(p), mean.values));
  if (!problem_.errors.empty()) TakeOwnGradients(problem_, input_, g, mean, at_);
}

std::vector<WalkGatherer::Shared> WalkGatherer::SharedWalks() const {
  std::vector<size_t> photographs;
  for (const FitPixels& p : at_.pixels) photographs.push_back(p.photograph);
  return WhichShareWalks(input_.capture, photographs);
}

std::vector<size_t> WalkGatherer::PhotographsOf(const Shared& shared) const {
  std::vector<size_t> photographs;
  for (const size_t g : shared) photographs.push_back(at_.pixels[g].photograph);
  return photographs;
}

PathOptions WalkGatherer::OptionsFor(const Shared& shared, double paths, int fewest) {
  const Camera& camera = SpecOf(at_.pixels[shared[0]]).camera;
  PathOptions options;
  options.wanted.assign(static_cast<size_t>(camera.width) * camera.height, 0);
  for (const size_t g : shared)
    for (const size_t place : PlacesOf(at_.pixels[g], CastOf(at_.pixels[g]), camera.width)) options.wanted[place] = 1;
  const double pixels = static_cast<double>(std::count(options.wanted.begin(), options.wanted.end(), 1));
  options.paths_per_pixel = std::max(fewest, static_cast<int>(std::ceil(paths / pixels)));
  options.seed = problem_.options.seed;
  options.stream = Key(kFitStream, ++run_);
  options.threads = problem_.options.threads;
  options.estimator = Estimator::kCollisions;
  at_.walked_paths += options.paths_per_pixel * pixels;
  return options;
}

std::vector<PathPhotograph> WalkGatherer::Predict(const Material& material, const Shared& shared,
                                                  const PathOptions& options, const std::string& stage) {
  return RenderTogether(input_.capture, bodies_.Of(material), input_.scenery, material, PhotographsOf(shared), options,
                        [&](double share) { progress_.Show(stage, share, SpecOf(at_.pixels[shared[0]]).name); });
}

void WalkGatherer::HandOver(const Material& material, const Shared& shared, int rays, PathOptions& options) {
  options.rays = rays;
  options.collisions = problem_.options.collisions;
  for (const size_t g : shared)
    options.collisions = std::max(options.collisions, CollisionsThatDepolarise(SpecOf(at_.pixels[g])));
  if (problem_.options.model != Model::kDiffusion)
    options.collisions = std::max(options.collisions, CollisionsThatTell(material));
  options.lattice = &bodies_.LatticeOf(material);
}

/// By walks that are soon handed over to diffusion, which tell derivatives by scattering with a hundred times less
/// noise, and wrong by some per cent: at the solution they only weigh what is left of the photographs, so they do not
/// move it.
///
/// All walks share one field of diffuse light. What its rays make uneven is in no group's noise and so is not taken
/// off: it looks like a shape by which the photographs tell scattering from a lamp's displacement. So rays grow with
/// the walks: 10,000 left the standard deviation of a disc's scattering a third too small (docs/validation.md).
void WalkGatherer::Differentiate(const Material& material, const Shared& shared, double paths, Told told,
                                 const std::string& stage) {
  PathOptions options = OptionsFor(shared, paths, kPathsOfAGroup * FewestPaths(material));
  HandOver(material, shared, static_cast<int>(rays_of_a_path_ * paths), options);
  options.field = run_;
  options.collisions = CollisionsThatTell(material);
  std::vector<DerivativeParameter> differenced;
  if (told != Told::kRoughness) differenced = differenced_;
  if (told != Told::kOthers) differenced.push_back(RoughnessOf(problem_.capture));
  auto found =
      DifferentiateByPaths(input_, bodies_, material, PhotographsOf(shared), options, differenced, stage, progress_);
  for (size_t k = 0; k < shared.size(); ++k)
    derivatives_[shared[k]].push_front({at_.x, static_cast<double>(options.paths_per_pixel), told != Told::kOthers,
                                        told != Told::kRoughness, std::move(found[k].derivatives),
                                        std::move(found[k].photo.pixels)});
}

/// Of the last runs' derivatives those from about here are kept, in the entries that photographs tell.
void WalkGatherer::ForgetSlopesFarAway() {
  constexpr double kNear = 0.3, kTold = 0.35;
  constexpr size_t kMost = 8;
  for (std::list<SlopesFound>& found : derivatives_) {
    found.remove_if([&](const SlopesFound& f) {
      Eigen::VectorXd off = f.at - at_.x;
      if (stddevs_.size() > 0) off = (stddevs_.array() > kTold).select(0.0, off);
      return unknowns_.LongestLogarithm(off) > kNear;
    });
    if (found.size() > kMost) found.resize(kMost, found.front());
  }
}

/// Makes derivatives until those from about here have so many paths, by roughness a share of it. Where that is few one
/// set of pictures tells all.
void WalkGatherer::AddSlopes(const Material& material, const Shared& shared, double paths, const std::string& stage) {
  constexpr double kEnough = 0.75, kRoughnessShare = 0.25, kFew = 200000.0;
  double of_roughness = 0, of_others = 0;
  for (const SlopesFound& f : derivatives_[shared[0]]) {
    const double of_all = f.paths * static_cast<double>(f.picture.size());
    if (f.of_roughness) of_roughness += of_all;
    if (f.of_others) of_others += of_all;
  }
  const double for_roughness = std::min(paths, std::max(kFew, kRoughnessShare * paths));
  const bool wants_others = of_others < kEnough * paths,
             wants_roughness =
                 unknowns_.IsFree(RoughnessOf(problem_.capture)) && of_roughness < kEnough * for_roughness;
  if (wants_others && wants_roughness && paths <= kFew)
    return Differentiate(material, shared, paths - of_others, Told::kAll, stage);
  if (wants_others) Differentiate(material, shared, paths - of_others, Told::kOthers, stage);
  if (wants_roughness) Differentiate(material, shared, for_roughness - of_roughness, Told::kRoughness, stage);
}

std::vector<RowsOfSlopes::Run> WalkGatherer::RunsOf(const std::list<SlopesFound>& found) {
  std::vector<RowsOfSlopes::Run> runs;
  for (const SlopesFound& f : found)
    runs.push_back(
        {&f.derivatives, f.paths, [roughness = f.of_roughness, others = f.of_others](const DerivativeParameter& p) {
           return p.quantity == Quantity::kRoughness ? roughness : others;
         }});
  return runs;
}

/// J' C^-1 of a picture that is brighter by its own size, channel by channel.
static Eigen::MatrixXd ByLevel(const WalkedRows& row, const WalkComparison& c, const Spectrum& value, size_t pixel) {
  WalkedRows::Rows whole(row.all.rows(), row.all.cols() + row.exact.cols());
  whole << row.all, row.exact;
  const Eigen::MatrixXd level = Eigen::Map<const Eigen::VectorXd>(value.begin(), value.size()).asDiagonal();
  return c.weight[pixel] * whole.transpose() * SolveSymmetric(c.covariance[pixel], level);
}

ResidualChi2 WalkGatherer::LeftOf(const WalkComparison& c) const {
  ResidualChi2 left = c.Left();
  if (walks_ == Walks::kHandedOver) left.regions = {};
  return left;
}

GatheredWalks WalkGatherer::Gather(double paths, double slope_paths, const std::string& stage) {
  MoveInput(problem_, at_, input_);
  ForgetSlopesFarAway();
  const Material material = MaterialAt(problem_.free, at_.x);
  pictures_.resize(at_.pixels.size());
  for (const Shared& shared : SharedWalks()) {
    PathOptions options = OptionsFor(shared, paths, FewestPaths(material));
    options.keeps_groups = true;
    if (walks_ == Walks::kHandedOver) HandOver(material, shared, kRaysOfValues, options);
    std::vector<PathPhotograph> walked = Predict(material, shared, options, stage);
    AddSlopes(material, shared, slope_paths, stage);
    for (size_t k = 0; k < shared.size(); ++k) {
      const FitPixels& p = at_.pixels[shared[k]];
      LearnFromPicture(shared[k], RanksOf(p, CastOf(p), walked[k]));
      pictures_[shared[k]] = std::move(walked[k]);
    }
  }
  ++at_.iterations;
  return Compare(problem_, unknowns_);
}

GatheredWalks WalkGatherer::Compare(const FitProblem& problem, const WalkUnknowns& unknowns) const {
  const Eigen::VectorXd x = unknowns.Here().head(unknowns.material());
  const Material material = MaterialAt(problem.free, x);
  const ModelError error = walks_ == Walks::kHandedOver ? DiffusionError(material, problem.options) : ModelError{};
  const WalkedStep none(unknowns.material(), derivatives_[0].front().derivatives.groups(), unknowns.nuisances());
  WalkedStep step = none;
  WalkComparison total;
  std::vector<std::vector<Spectrum>> values(at_.pixels.size());
  std::vector<ResidualChi2> left_of;
  Eigen::MatrixXd model_scatter = Eigen::MatrixXd::Zero(unknowns.count(), unknowns.count());
  for (size_t g = 0; g < at_.pixels.size(); ++g) {
    const FitPixels& p = at_.pixels[g];
    const PathPhotograph& walked = pictures_[g];
    const RowsOfSlopes rows(RunsOf(derivatives_[g]), unknowns.Chain(), unknowns.material());
    const std::vector<size_t> places = PlacesOf(p, CastOf(p), walked.width);
    const std::vector<Spectrum> smooth = SmoothedMeans(walked);
    std::vector<Spectrum> sharp;  // without the noise that what is left of a pixel shares
    for (const size_t rank : RanksOf(p, CastOf(p), walked)) {
      values[g].push_back(walked.pixels[rank].mean);
      sharp.push_back(smooth[rank]);
    }
    const double exposure = unknowns.ExposureOf(p);
    const WalkComparison c = CompareWithWalks(p, CastOf(p), walked, exposure, error.patch);
    const WalkUnknowns::Slopes nuisances(unknowns, g, input_.capture, material);
    constexpr size_t kParts = 64;  // fixed, so that sums do not depend on the number of threads
    std::vector<WalkedStep> parts(kParts, none);
    std::vector<Eigen::MatrixXd> by_level(kParts, Eigen::MatrixXd::Zero(unknowns.count(), p.channels()));
    ParallelFor(kParts, problem.options.threads, [&](size_t part) {
      for (size_t i = part * p.pixels.size() / kParts; i < (part + 1) * p.pixels.size() / kParts; ++i) {
        WalkedRows row = rows.Zero(unknowns.nuisances());
        for (const auto& [source, weight] : p.TermsOf(i)) rows.AddTo(row, places[source], exposure * weight);
        nuisances.AddTo(row.exact, i, sharp);
        if (error.photograph > 0) by_level[part] += ByLevel(row, c, p.values[i], i);
        parts[part].Add({c.residual[i], c.covariance[i] / c.weight[i], c.of_walks[i] / c.weight[i], c.off_by_group[i]},
                        std::move(row));
      }
    });
    for (const WalkedStep& part : parts) step.Add(part);
    const Eigen::MatrixXd levels =
        std::accumulate(by_level.begin(), by_level.end(), Eigen::MatrixXd(0.0 * by_level[0]));
    model_scatter += std::pow(error.channel, 2) * levels * levels.transpose() +
                     std::pow(error.photograph, 2) * levels.rowwise().sum() * levels.rowwise().sum().transpose();
    total.AddSums(c);
    left_of.push_back(LeftOf(c));
  }
  const FlatResiduals flat(problem.capture, problem.free, problem.options.threads);
  if (flat.count() > 0) {
    const FlatResiduals::Evaluation e = flat.Evaluate(x, true);
    step.AddExact(-e.residuals, e.jacobian);
  }
  return {std::move(step),   total.chi2 / static_cast<double>(total.values),
          LeftOf(total),     std::move(left_of),
          std::move(values), std::move(model_scatter)};
}

double WalkGatherer::MisfitOfPatches(double paths, const std::string& stage) {
  constexpr int kFewToCompare = 8;  // paths per pixel
  MoveInput(problem_, at_, input_);
  const Material material = MaterialAt(problem_.free, at_.x);
  double sum = 0;
  for (const Shared& shared : SharedWalks()) {
    PathOptions options = OptionsFor(shared, paths, kFewToCompare);
    options.keeps_groups = true;
    constexpr int kRays = 10000;
    if (walks_ == Walks::kHandedOver) HandOver(material, shared, kRays, options);
    const std::vector<PathPhotograph> walked = Predict(material, shared, options, stage);
    for (size_t k = 0; k < shared.size(); ++k) {
      const FitPixels& p = at_.pixels[shared[k]];
      const WalkComparison c = CompareWithWalks(p, CastOf(p), walked[k], unknowns_.ExposureOf(p));
      sum += c.Left().patches.chi2;
    }
  }
  return sum;
}

}  // namespace crownfit
