#include "fit_by_walks.h"

#include <algorithm>
#include <cmath>
#include <glm/gtx/component_wise.hpp>
#include <list>
#include <optional>

#include "base/parallel.h"
#include "fit/walk_comparison.h"
#include "path_derivatives.h"
#include "walk_unknowns.h"

namespace crownfit {
namespace {

class WalkFit {
 public:
  WalkFit(const FitProblem& problem, CrownInput& input, FitState& at, Progress& progress)
      : problem_(problem),
        input_(input),
        at_(at),
        progress_(progress),
        unknowns_(problem, at),
        bodies_(input, problem.options.threads),
        slopes_(at.pixels.size()) {
    for (const SlopeParameter& p : DifferencedParameters(problem.capture))
      if (unknowns_.IsFree(p) && p.quantity != Quantity::kRoughness) differenced_.push_back(p);
  }

  /// False when patches are further off than `to_beat`, after the search or at the end.
  bool Run(double to_beat) {
    at_.converged = false;
    ChooseStart();
    ChooseValley();
    if (at_.steps.back().block_chi2 > to_beat) return false;
    constexpr size_t kMostRuns = 8;
    constexpr double kShareOfWalks = 0.5;  // of the variance, that a fit tries to come below
    std::vector<Estimate> runs{LongRun()};
    size_t lost = 0;
    while (runs.size() + lost < kMostRuns && !(at_.converged && at_.knowledge.of_walks.mean() < kShareOfWalks)) {
      runs.push_back(LongRun());
      // Those that were still on their way only led here.
      if (runs.end()[-2].is_on_its_way || runs.back().is_on_its_way) runs.erase(runs.begin(), runs.end() - 1), ++lost;
      at_.converged = Conclude(runs) && runs.size() > 1;
    }
    return at_.knowledge.block_chi2 <= to_beat;
  }

 private:
  static constexpr double kSettled = 3.0;                          // gain of chi2 over that of noise alone
  static constexpr double kSearchShare = 0.2, kMiddleShare = 0.4;  // of a long run's paths
  static constexpr double kSlopeShare = 0.4;       // in long runs; derivatives of several runs are averaged
  static constexpr double kRoughnessShare = 0.25;  // of the paths for other derivatives
  static constexpr int kFewestPaths = 48;          // per pixel: derivatives' errors come from groups

  struct Estimate {
    Eigen::VectorXd unknowns;
    Eigen::MatrixXd covariance, of_walks;  ///< of the material's entries
    double chi2 = 0, block_chi2 = 0;
    std::vector<std::vector<glm::dvec3>> values;
    bool is_on_its_way;  ///< the step was cut short
  };

  double Paths() const { return static_cast<double>(problem_.options.paths_per_photograph); }

  /// The capture with its calibration and lamps where the fit has moved them.
  void MoveInput() {
    input_.capture = Moved(problem_.capture, problem_.errors, at_.calibration.amounts);
    for (size_t l = 0; l < input_.capture.lights.size(); ++l)
      input_.capture.lights[l].intensity_scale = at_.scales.light[l];
  }

  const PhotographSpec& SpecOf(const FitPixels& p) const { return input_.capture.photographs[p.photograph]; }
  const PhotographCast& CastOf(const FitPixels& p) const { return at_.cast.photographs[p.photograph]; }

  /// Numbers in FitState::pixels of photographs that share walks.
  using Shared = std::vector<size_t>;
  std::vector<Shared> SharedWalks() const {
    std::vector<size_t> photographs;
    for (const FitPixels& p : at_.pixels) photographs.push_back(p.photograph);
    return WhichShareWalks(input_.capture, photographs);
  }
  std::vector<size_t> PhotographsOf(const Shared& shared) const {
    std::vector<size_t> photographs;
    for (const size_t g : shared) photographs.push_back(at_.pixels[g].photograph);
    return photographs;
  }

  PathOptions OptionsFor(const Shared& shared, double paths, int fewest = kFewestPaths) {
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
    at_.walked_paths += options.paths_per_pixel * pixels;
    return options;
  }

  std::vector<PathPhotograph> Predict(const Material& material, const Shared& shared, const PathOptions& options) {
    return RenderTogether(input_.capture, bodies_.Of(material), input_.scenery, material, PhotographsOf(shared),
                          options,
                          [&](double share) { progress_.Show(stage_, share, SpecOf(at_.pixels[shared[0]]).name); });
  }

  /// A material with nearly the same derivatives of ln(pixel), whose walks tell them with several times less noise: a
  /// smooth surface with diffuse exits, and less forward scattering at the same reduced coefficient (similarity). The
  /// solution does not move by it: there the derivatives only weigh what is left of the photographs.
  Material SimilarForDerivatives(Material m, const LayeredBody& body) const {
    constexpr double kClear = 1.0, kForwardIfClear = 0.8, kForward = 0.5;
    for (size_t l = 0; l < m.layers.size(); ++l) {
      Material::Layer& layer = m.layers[l];
      if (unknowns_.IsFree({l, Quantity::kAsymmetry}) || unknowns_.IsFree({l, Quantity::kIsotropicFraction})) continue;
      const double deep = glm::compMin(body.high - body.low);
      const double thickness = l + 1 < m.layers.size() ? layer[ThicknessQuantity(problem_.capture, l)][0] : deep;
      const bool is_clear = layer[Quantity::kReducedScattering][1] * thickness < kClear;
      layer[Quantity::kAsymmetry].fill(std::min(layer[Quantity::kAsymmetry][0], is_clear ? kForwardIfClear : kForward));
    }
    m.surface[Quantity::kRoughness].fill(0.0);
    return m;
  }
  SlopeParameter Roughness() const { return {problem_.capture.layers.size(), Quantity::kRoughness}; }

  struct SlopesFound {
    Eigen::VectorXd at;
    double paths;
    bool of_roughness;  ///< it alone: the others' derivatives need no rough surface
    PooledSlopes slopes;
  };
  /// The last runs' slopes from about here; drops the others.
  std::vector<RowsOfSlopes::Run> SlopesNear(std::list<SlopesFound>& found) const {
    constexpr double kNear = 0.3;
    constexpr size_t kMost = 8;
    found.remove_if([&](const SlopesFound& f) { return unknowns_.LongestLogarithm(f.at - at_.x) > kNear; });
    if (found.size() > kMost) found.resize(kMost, found.front());
    std::vector<RowsOfSlopes::Run> runs;
    for (const SlopesFound& f : found)
      runs.push_back({&f.slopes, f.paths, [of_roughness = f.of_roughness](const SlopeParameter& p) {
                        return (p.quantity == Quantity::kRoughness) == of_roughness;
                      }});
    return runs;
  }

  struct Gathered {
    WalkedStep step;
    double chi2, block_chi2;
    std::vector<std::vector<glm::dvec3>> values;  ///< per photograph of the fit and sharp pixel
  };

  /// Walks every photograph at the point where the fit stands, once for values and once for derivatives.
  Gathered Gather(double paths, double slope_paths) {
    MoveInput();
    const Material material = MaterialAt(problem_.free, at_.x);
    const Material similar = SimilarForDerivatives(material, bodies_.Of(material));
    std::optional<WalkedStep> step;
    WalkComparison total;
    std::vector<std::vector<glm::dvec3>> values(at_.pixels.size());
    const auto differentiate = [&](const Shared& shared, const Material& m, double some, bool of_roughness) {
      PathOptions options = OptionsFor(shared, some);
      options.diffuse_exits = !of_roughness;
      auto found =
          DifferentiateByPaths(input_, bodies_, m, PhotographsOf(shared), options,
                               of_roughness ? std::vector<SlopeParameter>{Roughness()} : differenced_, progress_);
      for (size_t k = 0; k < shared.size(); ++k)
        slopes_[shared[k]].push_front(
            {at_.x, static_cast<double>(options.paths_per_pixel), of_roughness, std::move(found[k].slopes)});
    };
    for (const Shared& shared : SharedWalks()) {
      PathOptions options = OptionsFor(shared, paths);
      options.keeps_groups = true;
      const std::vector<PathPhotograph> walked = Predict(material, shared, options);
      differentiate(shared, similar, slope_paths, false);
      if (unknowns_.IsFree(Roughness())) {
        Material rough = similar;
        rough.surface[Quantity::kRoughness] = material.surface[Quantity::kRoughness];
        differentiate(shared, rough, kRoughnessShare * slope_paths, true);
      }
      for (size_t k = 0; k < shared.size(); ++k) {
        const size_t g = shared[k];
        const FitPixels& p = at_.pixels[g];
        const RowsOfSlopes rows(SlopesNear(slopes_[g]), unknowns_.Chain(), unknowns_.material());
        const std::vector<size_t> places = PlacesOf(p, CastOf(p), walked[k].width);
        const std::vector<glm::dvec3> smooth = SmoothedMeans(walked[k]);
        std::vector<glm::dvec3> sharp;  // without the noise that what is left of a pixel shares
        for (const size_t rank : RanksOf(p, CastOf(p), walked[k])) {
          values[g].push_back(walked[k].pixels[rank].mean);
          sharp.push_back(smooth[rank]);
        }
        const double exposure = unknowns_.ExposureOf(p);
        const WalkComparison c = CompareWithWalks(p, CastOf(p), walked[k], exposure);
        const WalkUnknowns::Slopes nuisances(unknowns_, g, input_.capture, material);
        const WalkedStep none(unknowns_.material(), slopes_[g].front().slopes.groups(), unknowns_.nuisances());
        if (!step) step.emplace(none);
        constexpr size_t kParts = 64;  // fixed, so that sums do not depend on the number of threads
        std::vector<WalkedStep> parts(kParts, none);
        ParallelFor(kParts, problem_.options.threads, [&](size_t part) {
          for (size_t i = part * p.pixels.size() / kParts; i < (part + 1) * p.pixels.size() / kParts; ++i) {
            WalkedRows row = rows.Zero(unknowns_.nuisances());
            for (int t = p.first_term[i]; t < p.first_term[i + 1]; ++t)
              rows.AddTo(row, places[p.terms[t].source], exposure * p.terms[t].weight);
            nuisances.AddTo(row.exact, i, sharp);
            parts[part].Add(
                {c.residual[i], c.covariance[i] / c.weight[i], c.of_walks[i] / c.weight[i], c.off_by_group[i]},
                std::move(row));
          }
        });
        for (const WalkedStep& part : parts) step->Add(part);
        total.chi2 += c.chi2, total.block_chi2 += c.block_chi2;
        total.values += c.values, total.block_values += c.block_values;
      }
    }
    ++at_.iterations;
    return {std::move(*step), total.chi2 / static_cast<double>(total.values),
            total.block_chi2 / static_cast<double>(total.block_values), std::move(values)};
  }

  /// Takes the better one of where the fit stands and the capture's own start values.
  void ChooseStart() {
    constexpr int kFewToCompare = 8;  // paths per pixel
    stage_ = "walking from the start";
    const auto misfit = [&] {
      MoveInput();
      const Material material = MaterialAt(problem_.free, at_.x);
      double sum = 0;
      for (const Shared& shared : SharedWalks()) {
        const std::vector<PathPhotograph> walked =
            Predict(material, shared, OptionsFor(shared, 0.25 * kSearchShare * Paths(), kFewToCompare));
        for (size_t k = 0; k < shared.size(); ++k) {
          const FitPixels& p = at_.pixels[shared[k]];
          const WalkComparison c = CompareWithWalks(p, CastOf(p), walked[k], unknowns_.ExposureOf(p));
          sum += c.block_chi2 / static_cast<double>(c.block_values);
        }
      }
      return sum;
    };
    const Eigen::VectorXd from = unknowns_.Here();
    const double misfit_from = misfit();
    unknowns_.GoTo(unknowns_.Stated());
    if (misfit() > misfit_from) unknowns_.GoTo(from);
  }

  /// Searches. A free roughness may have several optima (a lobe that reaches the camera and one that does not make the
  /// same level): it is searched for from small, middle and large ones too, and the best is kept.
  void ChooseValley() {
    constexpr double kSameValley = 1.6;
    const auto search = [&] {
      for (const double share : {kSearchShare, kMiddleShare}) Search(share * Paths());
    };
    const int roughness = unknowns_.EntryOf(Roughness());
    if (roughness < 0) return search();
    const Eigen::VectorXd from = unknowns_.Here();
    std::vector<double> starts{from[roughness]};
    for (const double r : {0.1, 0.25, 0.55}) {
      const double start = unknowns_.InItsScale(roughness, r);
      if (std::none_of(starts.begin(), starts.end(),
                       [&](double s) { return std::abs(s - start) < std::log(kSameValley); }))
        starts.push_back(start);
    }
    std::vector<std::pair<double, Eigen::VectorXd>> found;  // misfit, where
    for (const double start : starts) {
      Eigen::VectorXd there = from;
      there[roughness] = start;
      unknowns_.GoTo(there);
      search();
      const Estimate e = LongRun();
      found.emplace_back(e.block_chi2, e.unknowns);
    }
    unknowns_.GoTo(std::min_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
                     return a.first < b.first;
                   })->second);
  }

  /// Steps until they gain no more than noise does. Where one made things worse it is taken back, and derivatives get
  /// twice the paths.
  void Search(double paths) {
    constexpr double kReach = 0.4, kLongest = 0.7, kWorse = 1.5;
    constexpr int kMostSteps = 20;
    double slope_paths = paths, best = HUGE_VAL;
    Eigen::VectorXd best_at = unknowns_.Here();
    for (int i = 0; i < kMostSteps; ++i) {
      stage_ = "walking, step " + std::to_string(at_.steps.size() + 1);
      Gathered g = Gather(paths, slope_paths);
      if (g.block_chi2 > kWorse * best && slope_paths < Paths()) {
        slope_paths *= 2.0;
        unknowns_.GoTo(best_at);
        g = Gather(paths, slope_paths);
      }
      best = g.block_chi2;
      best_at = unknowns_.Here();
      WalkedStep::Solution s;
      const Eigen::VectorXd whole =
          unknowns_.Bounded(g.step, unknowns_.Prior(kReach, problem_.options.use_priors), WalkedStep::Noise::kLeft, s);
      const Eigen::VectorXd step = unknowns_.Shortened(whole, kLongest);
      Record("search", paths, g, step, s);
      unknowns_.GoTo(best_at + step);
      if (s.gain <= kSettled * s.noise_gain) break;
    }
  }

  Estimate LongRun() {
    constexpr double kReach = 3.0, kLongest = 0.5, kNothingKnown = 100.0;
    stage_ = "walking, long run, step " + std::to_string(at_.steps.size() + 1);
    Gathered g = Gather(Paths(), kSlopeShare * Paths());
    WalkedStep::Solution s;
    const Eigen::VectorXd step =
        unknowns_.Shortened(unknowns_.Bounded(g.step, unknowns_.Prior(kReach, problem_.options.use_priors),
                                              WalkedStep::Noise::kTakenOff, s),
                            kLongest);
    Record("run", Paths(), g, step, s);
    const WalkedStep::Solution data = g.step.Solve(unknowns_.Prior(kNothingKnown, false));
    const int n = unknowns_.material();
    Estimate e{unknowns_.Here() + step,
               data.covariance.topLeftCorner(n, n),
               data.walk_covariance.topLeftCorner(n, n),
               g.chi2,
               g.block_chi2,
               std::move(g.values),
               unknowns_.LongestLogarithm(step) > 0.99 * kLongest};
    unknowns_.GoTo(e.unknowns);
    return e;
  }

  /// Goes to the runs' mean and says what is known there; true when they agree: two at once, or several that scatter
  /// by somewhat more than their walks, which then widens the intervals.
  bool Conclude(const std::vector<Estimate>& runs) {
    constexpr double kAgreeAtOnce = 2.0, kAgree = 5.0;  // mean square of scatter in standard deviations of the walks
    constexpr size_t kSeveral = 4;
    const double n = static_cast<double>(runs.size());
    const int m = unknowns_.material();
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(unknowns_.count());
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(m, m), of_walks = covariance;
    DataKnowledge k;
    at_.walked.clear();
    for (const auto& values : runs[0].values) at_.walked.emplace_back(values.size(), glm::dvec3(0.0));
    for (const Estimate& e : runs) {
      mean += e.unknowns / n;
      covariance += e.covariance / n;
      of_walks += e.of_walks / n;
      k.reduced_chi2 += e.chi2 / n;
      k.block_chi2 += e.block_chi2 / n;
      for (size_t g = 0; g < at_.walked.size(); ++g)
        for (size_t i = 0; i < at_.walked[g].size(); ++i) at_.walked[g][i] += e.values[g][i] / n;
    }
    double off = 0;
    for (const Estimate& e : runs)
      off += (e.unknowns - mean).head(m).cwiseAbs2().cwiseQuotient(of_walks.diagonal().cwiseMax(1e-12)).sum();
    const Eigen::MatrixXd walks_alone = of_walks;
    const double scatter = runs.size() > 1 && m > 0 ? off / (m * (n - 1.0)) : 0.0;
    of_walks *= std::max(1.0, scatter);
    unknowns_.GoTo(mean);
    k.inflation = std::max(1.0, k.block_chi2);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> data(covariance - walks_alone);
    k.covariance = k.inflation * data.eigenvectors() * data.eigenvalues().cwiseMax(0.0).asDiagonal() *
                       data.eigenvectors().transpose() +
                   of_walks / n;
    k.unseen = Eigen::MatrixXd::Zero(m, 0);
    k.of_walks = of_walks.diagonal().cwiseQuotient(n * k.covariance.diagonal());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> all(k.covariance);
    if (m > 0) k.condition = std::sqrt(all.eigenvalues()[m - 1] / all.eigenvalues()[0]);
    at_.knowledge = k;
    return scatter <= (runs.size() < kSeveral ? kAgreeAtOnce : kAgree);
  }

  void Record(const std::string& stage, double paths, const Gathered& g, const Eigen::VectorXd& step,
              const WalkedStep::Solution& s) {
    const int n = unknowns_.material();
    at_.steps.push_back({stage, paths, g.chi2, g.block_chi2, at_.x, step.head(n),
                         s.covariance.diagonal().head(n).cwiseSqrt(),
                         s.walk_covariance.diagonal().head(n).cwiseSqrt()});
  }

  const FitProblem& problem_;
  CrownInput& input_;
  FitState& at_;
  Progress& progress_;
  WalkUnknowns unknowns_;
  Bodies bodies_;
  std::vector<SlopeParameter> differenced_;
  std::vector<std::list<SlopesFound>> slopes_;  ///< per photograph of the fit, latest first
  uint64_t run_ = 0;
  std::string stage_;
};

}  // namespace

bool FitByWalks(const FitProblem& problem, CrownInput& input, FitState& at, bool must_explain_more,
                Progress& progress) {
  if (problem.free.count() == 0) return true;
  const double to_beat = must_explain_more ? at.knowledge.block_chi2 : HUGE_VAL;
  const FitState before = at;
  if (WalkFit(problem, input, at, progress).Run(to_beat)) return true;
  at = before;
  input.capture = Moved(problem.capture, problem.errors, at.calibration.amounts);
  return false;
}

}  // namespace crownfit
